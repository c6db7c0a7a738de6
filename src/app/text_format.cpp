#include "app/text_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace kairos {

std::string formatted(const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  std::string text(size_t(std::max(0, std::vsnprintf(nullptr, 0, format, arguments))), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  va_end(arguments);
  return text;
}

std::string byteText(double bytes) {
  static constexpr std::array kUnits{"B", "kB", "MB", "GB", "TB", "PB"};
  size_t unit = 0;
  while (bytes >= 999.5 && unit + 1 < kUnits.size()) {
    bytes /= 1000;
    ++unit;
  }
  return formatted("%.*f %s", unit == 0 || bytes >= 99.95 ? 0 : bytes >= 9.995 ? 1 : 2, bytes, kUnits[unit]);
}

std::string groupedText(uint64_t count) {
  std::string text = std::to_string(count);
  for (size_t end = text.size(); end > 3; end -= 3) text.insert(end - 3, 1, ' ');
  return text;
}

std::string percentText(double fraction) {
  const double percent = 100 * fraction;
  if (percent == 0) return "0 %";
  if (percent >= 99.95) return formatted("%.0f %%", percent);
  return formatted("%.*f %%", std::clamp(1 - int(std::floor(std::log10(percent))), 0, 6), percent);
}

std::string durationText(double seconds) {
  if (seconds < 10) return formatted("%.2f s", seconds);
  if (seconds < 120) return formatted("%.0f s", seconds);
  const auto whole = (long long)(std::llround(seconds));
  if (whole < 7200) return formatted("%lld min %lld s", whole / 60, whole % 60);
  return formatted("%lld h %lld min", whole / 3600, whole / 60 % 60);
}

std::string countText(uint64_t count, const std::string& singular) {
  return groupedText(count) + " " + singular + (count == 1 ? "" : "s");
}

std::string listText(const std::vector<std::string>& items, size_t shown) {
  std::string text;
  for (size_t i = 0; i < std::min(shown, items.size()); ++i) text += (i ? ", " : "") + items[i];
  if (items.size() > shown) text += " and " + std::to_string(items.size() - shown) + " more";
  return text;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

}  // namespace kairos
