// An axis: where a value stands on it, and which values are marked.
#pragma once

#include <string>
#include <vector>

namespace kairos::plot {

struct Tick {
  double value;
  std::string label;  // empty: a minor tick
};

/// Maps values to [0, 1], linearly or logarithmically. The ends are round numbers that enclose the range
/// asked for.
class Scale {
 public:
  Scale() : Scale(linear(0, 1)) {}
  /// Encloses [lo, hi] by multiples of a step of 1, 2 or 5 times a power of ten, with about `ticks` of them.
  static Scale linear(double lo, double hi, int ticks = 5);
  /// Encloses [lo, hi], both above 0, by 1, 2 or 5 times a power of ten.
  static Scale logarithmic(double lo, double hi);
  /// Logarithmic where both ends are above 0 and further apart than `ratio`; otherwise linear from 0, or from
  /// `lo` where that is below 0.
  static Scale automatic(double lo, double hi, double ratio = 12);

  double lo() const { return lo_; }
  double hi() const { return hi_; }
  bool isLogarithmic() const { return logarithmic_; }
  /// Ascending, all within [lo, hi].
  const std::vector<Tick>& ticks() const { return ticks_; }
  /// Values outside stand at the nearer end; so do values that a logarithm does not have.
  double position(double value) const;

 private:
  Scale(double lo, double hi, bool logarithmic) : lo_(lo), hi_(hi), logarithmic_(logarithmic) {}

  double lo_, hi_;
  bool logarithmic_;
  std::vector<Tick> ticks_;
};

/// "1234", "0.25", "0.0031", "2.5e-05": `digits` significant ones, plain decimals from 1e-4 to 1e6.
std::string shortNumber(double value, int digits = 4);

}  // namespace kairos::plot
