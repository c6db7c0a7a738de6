// When a frame is good enough.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "diff/frame_renderer.h"

namespace kairos {

/// An error that frames may have: met where the 95 % interval of what rays measured ends below it. Refinement
/// works towards the squared error that a model expects, `allowed`, which is learned from how far the
/// intervals' ends were from the goal.
class ErrorGoal {
 public:
  /// What is stopped by measured errors needs more rays to measure them than what only reports them.
  static constexpr double kProbeDensity = 4;

  /// `values`: of an image, all channels.
  ErrorGoal(double rmse, double values) : rmse_(rmse), total_(rmse * rmse * values) {}

  void beginFrame() {
    allowed_ = share_ * total_;
    first_ = true;
    least_ = pending_ = 0;
  }
  /// Sum of squared errors over the image that refinement is to get down to, by its model.
  double allowed() const { return allowed_; }

  /// How much of the expected error the next batch is to take: half of what is too much, so that the next one
  /// can go by what this one showed. Nothing when the goal is met.
  double batchGain(double expected) const {
    const double excess = expected - allowed_;
    return excess > 0 ? std::max(excess / 2, kSmallestGain * allowed_) : 0;
  }

  /// How many items the next batch is to take at the least, where the model expects next to nothing although
  /// the rays found something. Once asked, 0 until the next measurement.
  size_t takeLeast() { return std::exchange(pending_, 0); }

  /// Is the frame good enough, as measured? If not, less is allowed from now on than the model expects of it.
  /// Frames whose error cannot be measured are taken at the model's word.
  bool reached(const std::optional<ErrorEstimate>& measured, double expected) {
    if (!measured) return true;
    const double ratio = measured->high / rmse_;
    if (first_)
      share_ =
          std::clamp(share_ * ((1 - kMemory) * kAim / std::max(ratio * ratio, 1e-3) + kMemory), 0.02, 1.5);
    first_ = false;
    if (ratio <= 1) return true;
    allowed_ = std::min(allowed_, expected * std::clamp(kAim / (ratio * ratio), kFastest, kSlowest));
    if (expected < kNothing * total_) least_ = pending_ = std::max(kFewestItems, 2 * least_);
    return false;
  }

 private:
  static constexpr size_t kFewestItems = 16;
  static constexpr double kNothing = 0.02;  // of the squared goal: what the model expects is beside the point
  static constexpr double kSmallestGain = 0.05;
  static constexpr double kMemory = 0.7;  // of what is allowed, in the next frame
  static constexpr double kAim = 0.8;     // of the squared goal: most frames are to meet it at once
  // Of the expected error, from one measurement to the next: few rays may have met a rare large one.
  static constexpr double kSlowest = 0.9, kFastest = 0.5;

  double rmse_, total_, share_ = 0.5, allowed_ = 0;
  size_t least_ = 0, pending_ = 0;
  bool first_ = true;
};

}  // namespace kairos
