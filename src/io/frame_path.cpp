// Output names with a place for the time step.
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "core/error.h"
#include "io/atomic_file.h"
#include "io/image_file.h"

namespace kairos {
namespace {

struct StepPlace {
  size_t begin, length;  // in the pattern
  int digits;
};

// "%d" and "%04d" at `at`.
std::optional<StepPlace> printfPlace(const std::string& pattern, size_t at) {
  size_t end = at + 1;
  while (end < pattern.size() && std::isdigit(static_cast<unsigned char>(pattern[end]))) ++end;
  if (end >= pattern.size() || pattern[end] != 'd' || end - at > 4) return std::nullopt;
  const int digits = end > at + 1 ? std::atoi(pattern.c_str() + at + 1) : 1;
  return StepPlace{at, end + 1 - at, digits};
}

// The last place for a step in the file name (not in its directory).
std::optional<StepPlace> findStepPlace(const std::string& pattern) {
  const size_t slash = pattern.rfind('/'), name = slash == std::string::npos ? 0 : slash + 1;
  std::optional<StepPlace> place;
  for (size_t i = name; i < pattern.size(); ++i) {
    if (pattern[i] == '%') {
      if (const auto found = printfPlace(pattern, i)) place = found;
    } else if (pattern[i] == '#') {
      const size_t end = std::min(pattern.find_first_not_of('#', i), pattern.size());
      place = StepPlace{i, end - i, int(end - i)};
      i = end - 1;
    }
  }
  return place;
}

}  // namespace

std::string framePath(const std::string& pattern, long long step) {
  const auto place = findStepPlace(pattern);
  if (!place) return pattern;
  std::string digits = std::to_string(step < 0 ? -step : step);
  if (int(digits.size()) < place->digits) digits.insert(0, size_t(place->digits) - digits.size(), '0');
  return std::string(pattern).replace(place->begin, place->length, (step < 0 ? "-" : "") + digits);
}

void checkOutputPattern(const std::string& pattern, bool singleImage) {
  const std::filesystem::path path(pattern);
  if (path.extension() != ".exr")
    throw OptionError("-o", "\"" + pattern + "\" does not end in .exr, expected a name like frame.####.exr");
  if (!singleImage && !findStepPlace(pattern))
    throw OptionError(
        "-o", "\"" + pattern + "\" has no place for the time step, expected a name like frame.####.exr");
  makeWritableDirectory(path.parent_path().string());
}

}  // namespace kairos
