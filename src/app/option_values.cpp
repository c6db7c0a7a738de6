#include "app/option_values.h"

#include <charconv>
#include <cmath>

#include "core/error.h"

namespace kairos {
namespace {

template <class T>
std::optional<T> parse(const std::string& text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> parsedNumber(const std::string& text) {
  const auto value = parse<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int64_t> parsedInteger(const std::string& text) {
  return parse<int64_t>(text);
}

void refuseValue(const std::string& option, const std::string& text, const std::string& expected) {
  throw OptionError(option, "found \"" + text + "\", expected " + expected);
}

double numberOption(const std::string& option, const std::string& text, double lo, double hi,
                    const std::string& expected) {
  const auto value = parsedNumber(text);
  if (!value || !(*value >= lo && *value <= hi)) refuseValue(option, text, expected);
  return *value;
}

int64_t integerOption(const std::string& option, const std::string& text, int64_t lo, int64_t hi,
                      const std::string& expected) {
  const auto value = parsedInteger(text);
  if (!value || *value < lo || *value > hi) refuseValue(option, text, expected);
  return *value;
}

std::vector<std::string> commaSeparated(const std::string& text) {
  std::vector<std::string> words;
  for (size_t begin = 0;;) {
    const size_t comma = text.find(',', begin);
    words.push_back(text.substr(begin, comma - begin));
    if (comma == std::string::npos) return words;
    begin = comma + 1;
  }
}

std::vector<double> numbersOption(const std::string& option, const std::string& text, size_t count,
                                  const std::string& expected) {
  std::vector<double> numbers;
  for (const std::string& word : commaSeparated(text)) {
    const auto value = parsedNumber(word);
    if (!value) refuseValue(option, text, expected);
    numbers.push_back(*value);
  }
  if (numbers.size() != count) refuseValue(option, text, expected);
  return numbers;
}

Vec3d vectorOption(const std::string& option, const std::string& text, const std::string& expected) {
  const std::vector<double> n = numbersOption(option, text, 3, expected);
  return {n[0], n[1], n[2]};
}

uint64_t bytesOption(const std::string& option, const std::string& text) {
  static const char* const kExpected = "a size from 0 to 1024TiB such as 512MiB or 2GiB";
  constexpr const char* kSuffixes[] = {"KiB", "MiB", "GiB", "TiB"};
  std::string number = text;
  double unit = 1, factor = 1;
  for (const char* suffix : kSuffixes) {
    factor *= 1024;
    if (!text.ends_with(suffix)) continue;
    number = text.substr(0, text.size() - 3);
    unit = factor;
  }
  const auto value = parsedNumber(number);
  constexpr double kMost = 1024.0 * 1024 * 1024 * 1024 * 1024;
  if (!value || !(*value >= 0 && *value * unit <= kMost)) refuseValue(option, text, kExpected);
  return uint64_t(*value * unit);
}

Budget budgetOption(const std::string& option, const std::string& text) {
  static const char* const kExpected =
      "a time of 0.1ms to 1e6ms such as 40ms, a rate of 0.001fps to 10000fps such as 25fps, or a number of "
      "samples of 1000 to 1e15 such as samples:2e6, or an error of 1e-5 to 0.5 such as error:1e-3";
  const auto number = [&](const std::string& digits, double lo, double hi) {
    const auto value = parsedNumber(digits);
    if (!value || !(*value >= lo && *value <= hi)) refuseValue(option, text, kExpected);
    return *value;
  };
  static const std::string kSamples = "samples:", kError = "error:";
  if (text.starts_with(kSamples))
    return Budget::ofSamples(uint64_t(number(text.substr(kSamples.size()), 1e3, 1e15)));
  if (text.starts_with(kError)) return Budget::ofError(number(text.substr(kError.size()), 1e-5, 0.5));
  if (text.ends_with("fps"))
    return Budget::framesPerSecond(number(text.substr(0, text.size() - 3), 1e-3, 1e4));
  if (text.ends_with("ms")) return Budget::time(number(text.substr(0, text.size() - 2), 0.1, 1e6));
  refuseValue(option, text, kExpected);
}

StepRange stepRangeOption(const std::string& option, const std::string& text) {
  static const char* const kExpected = "time steps as A-B, A, A- or -B";
  const auto end = [&](const std::string& digits) -> std::optional<int64_t> {
    if (digits.empty()) return std::nullopt;
    return integerOption(option, digits, 0, INT64_MAX, kExpected);
  };
  const size_t dash = text.find('-');
  StepRange range;
  try {
    range.first = end(text.substr(0, dash));
    range.last = dash == std::string::npos ? range.first : end(text.substr(dash + 1));
  } catch (const OptionError&) {
    refuseValue(option, text, kExpected);
  }
  if (!range.first && !range.last) refuseValue(option, text, kExpected);
  if (range.first && range.last && *range.first > *range.last)
    refuseValue(option, text, std::string(kExpected) + " with A not after B");
  return range;
}

size_t choiceOption(const std::string& option, const std::string& text,
                    const std::vector<std::string>& choices) {
  for (size_t i = 0; i < choices.size(); ++i)
    if (choices[i] == text) return i;
  std::string list;
  for (size_t i = 0; i < choices.size(); ++i)
    list += (i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i];
  refuseValue(option, text, list);
}

}  // namespace kairos
