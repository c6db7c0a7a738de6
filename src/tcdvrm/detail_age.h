// How much less interpolation misses where rays found an earlier image's detail not long ago.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace kairos {

/// Squared error with the share of old detail (DetailBlend) to that without, by the number of frames since
/// rays found the detail: learned where rays are cast again. Ages not seen yet are expected to be worse than
/// the next younger one by half.
class DetailAge {
 public:
  static constexpr uint32_t kOldest = 12;  // frames; what is older counts as no detail at all

  void observe(uint32_t age, double withDetail, double without) {
    if (age < 1 || age > kOldest) return;
    Sums& s = sums_[age];
    s = {s.with + withDetail, s.without + without};
  }
  /// Makes a frame's observations count.
  void endFrame() {
    double ratio = 1 / kGrowth;
    for (uint32_t age = 1; age <= kOldest; ++age) {
      Sums& s = sums_[age];
      const double grown = std::min(1.0, ratio * kGrowth);
      ratio = s.without > 0 ? std::clamp(s.with / s.without, kLeast, 1.0) : grown;
      ratios_[age] = ratio;
      s = {s.with * kMemory, s.without * kMemory};
    }
  }
  double ratio(uint32_t age) const { return age >= 1 && age <= kOldest ? ratios_[age] : 1; }

 private:
  static constexpr double kGrowth = 1.5, kLeast = 0.005, kMemory = 0.7;
  struct Sums {
    double with = 0, without = 0;
  };
  std::array<Sums, kOldest + 1> sums_{};
  std::array<double, kOldest + 1> ratios_ = allOnes();
  static constexpr std::array<double, kOldest + 1> allOnes() {
    std::array<double, kOldest + 1> ones{};
    for (double& one : ones) one = 1;
    return ones;
  }
};

}  // namespace kairos
