// What is left of a frame's budget, and what a piece of work will take of it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/budget.h"

namespace kairos {

/// Casting, counted: classified samples and integrated segments.
struct CastWork {
  double samples = 0, segments = 0;

  CastWork& operator+=(const CastWork& o) {
    samples += o.samples;
    segments += o.segments;
    return *this;
  }
  friend CastWork operator*(CastWork w, double factor) { return {w.samples * factor, w.segments * factor}; }
};

/// The middle one of the last few values: a single stall says nothing, a lasting change soon does.
class RunningMedian {
 public:
  explicit RunningMedian(double initial) : median_(initial), last_(initial) {}
  void add(double value);
  double value() const { return median_; }
  double last() const { return last_; }

 private:
  static constexpr size_t kCount = 5;
  std::array<double, kCount> values_{};
  size_t count_ = 0;
  double median_, last_;
};

/// Time of casting as a linear function of its work. The proportion between samples and segments is learned
/// slowly (least squares with fading memory), the speed as the median of the last batches.
class CostModel {
 public:
  void learn(CastWork work, double ms);
  double milliseconds(CastWork work) const { return speed_.value() * linear(work); }
  /// How many times slower than expected the last batch was; at least 1.
  double caution() const { return std::max(1.0, speed_.last() / speed_.value()); }

 private:
  double linear(CastWork work) const { return perSample_ * work.samples + perSegment_ * work.segments; }
  void solve();

  double perSample_ = 3e-6, perSegment_ = 60e-6;
  RunningMedian speed_{1};
  double ss_ = 0, sg_ = 0, gg_ = 0, st_ = 0, gt_ = 0;  // normal equations
};

/// One frame's budget, in its own unit: milliseconds or samples. Samples are counted, so that a run under
/// such a budget depends on no clock.
class BudgetMeter {
 public:
  BudgetMeter(const Budget& budget, BudgetClock* clock);

  void beginFrame();
  bool limited() const { return budget_.limited(); }
  bool timed() const { return budget_.milliseconds > 0; }
  /// The whole budget; infinite without one.
  double total() const;
  /// What is left, below 0 when it is overdrawn.
  double remaining();
  /// What is safe to begin of what is left: less while the machine is slower than expected.
  double safely(double left) const { return timed() ? left / model_.caution() : left; }
  double cost(CastWork work) const { return timed() ? model_.milliseconds(work) : work.samples; }

  /// Casting work is bracketed by these two: what was done is charged and, if it is of the usual kind,
  /// teaches the cost model. Returns the milliseconds it took.
  void beginCasting();
  double endCasting(CastWork work, bool usual = true);
  /// Milliseconds from the frame's beginning.
  double elapsed() { return clock_.now() - begin_; }

 private:
  Budget budget_;
  BudgetClock& clock_;
  CostModel model_;
  double begin_ = 0, castingBegin_ = 0, samples_ = 0;
};

}  // namespace kairos
