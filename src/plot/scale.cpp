#include "plot/scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace kairos::plot {
namespace {

std::string printed(const char* format, int digits, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, digits, value);
  return text.data();
}

// The smallest of 1, 2, 5, 10 times a power of ten that is at least `value`, within rounding.
double roundUp(double value) {
  const double decade = std::pow(10, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= value * (1 - 1e-9)) return factor * decade;
  return 10 * decade;
}

double roundDown(double value) {
  const double decade = std::pow(10, std::floor(std::log10(value) + 1e-9));
  for (const double factor : {5.0, 2.0})
    if (factor * decade <= value * (1 + 1e-9)) return factor * decade;
  return decade;
}

std::string superscript(int number) {
  static constexpr std::array kDigits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(number))) text += kDigits[size_t(c - '0')];
  return text;
}

std::string logLabel(double value) {
  const int exponent = int(std::floor(std::log10(value) + 1e-9));
  if (exponent >= -3 && exponent <= 4) return shortNumber(value);
  const auto factor = int(std::lround(value / std::pow(10, exponent)));
  return (factor == 1 ? "" : std::to_string(factor) + "·") + "10" + superscript(exponent);
}

}  // namespace

Scale Scale::linear(double lo, double hi, int ticks) {
  if (!(hi > lo)) hi = lo + std::max(1.0, std::abs(lo) * 0.1);
  const double step = roundUp((hi - lo) / std::max(1, ticks));
  const double first = std::floor(lo / step + 1e-9), last = std::ceil(hi / step - 1e-9);
  const int decimals = std::max(0, int(-std::floor(std::log10(step) + 1e-9)));
  Scale scale(first * step, last * step, false);
  for (double i = first; i <= last; ++i)
    scale.ticks_.push_back({i * step, printed("%.*f", decimals, i * step + 0.0)});
  return scale;
}

Scale Scale::logarithmic(double lo, double hi) {
  lo = roundDown(lo);
  hi = std::max(roundUp(hi), 2 * lo);
  Scale scale(lo, hi, true);
  const double decades = std::log10(hi / lo);
  const int first = int(std::floor(std::log10(lo) + 1e-9)), last = int(std::ceil(std::log10(hi) - 1e-9));
  const int every = decades > 7 ? 2 : 1;  // labels at every second power of ten
  for (int exponent = first; exponent <= last; ++exponent)
    for (const int factor : {1, 2, 5}) {
      const double value = factor * std::pow(10, exponent);
      if (value < lo * (1 - 1e-9) || value > hi * (1 + 1e-9)) continue;
      const bool labelled = factor == 1 ? exponent % every == 0 : decades < 2.4;
      scale.ticks_.push_back({value, labelled ? logLabel(value) : ""});
    }
  return scale;
}

Scale Scale::automatic(double lo, double hi, double ratio) {
  if (lo > 0 && hi > ratio * lo) return logarithmic(lo, hi);
  return linear(std::min(lo, 0.0), hi);
}

double Scale::position(double value) const {
  const double t = logarithmic_ ? (value > 0 ? std::log(value / lo_) / std::log(hi_ / lo_) : 0)
                                : (value - lo_) / (hi_ - lo_);
  return std::clamp(t, 0.0, 1.0);
}

std::string shortNumber(double value, int digits) {
  if (!std::isfinite(value)) return std::isnan(value) ? "–" : value > 0 ? "∞" : "-∞";
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-4 || size >= 1e6)) return printed("%.*g", digits, value);
  const int whole = size == 0 ? 0 : int(std::floor(std::log10(size) + 1e-12));
  std::string text = printed("%.*f", std::clamp(digits - 1 - whole, 0, 10), value);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace kairos::plot
