#include "tcdvrm/detail_blend.h"

#include <algorithm>

namespace kairos {
namespace {

constexpr double kMemory = 0.5;       // of a frame's observations after the next
constexpr double kShrink = 0.01;      // weight of the whole image in a region's regression
constexpr double kWorthwhile = 0.25;  // share of the residuals' squares that blending has to explain

}  // namespace

DetailBlend::DetailBlend(int imageWidth, int imageHeight)
    : columns_((imageWidth + kRegionEdge - 1) / kRegionEdge), blocks_(imageWidth, imageHeight) {
  for (auto& level : fresh_) level.assign(blocks_.size(), 1);
  const size_t regions = size_t(columns_) * size_t((imageHeight + kRegionEdge - 1) / kRegionEdge);
  for (auto& level : sums_) level.resize(regions);
  for (auto& level : lambdas_) level.assign(regions, 0.0f);
}

void DetailBlend::beginFrame() {
  double explained = 0, total = 0;
  for (int level = 0; level < kLevels; ++level) {
    Sums all;
    for (const Sums& s : sums_[size_t(level)]) {
      all.xy += s.xy;
      all.xx += s.xx;
      all.yy += s.yy;
    }
    const double shrink = kShrink * all.xx + 1e-12, mean = all.xx > 0 ? all.xy / all.xx : 0;
    for (size_t region = 0; region < lambdas_[size_t(level)].size(); ++region) {
      Sums& s = sums_[size_t(level)][region];
      const double lambda = (s.xy + shrink * mean) / (s.xx + shrink);
      lambdas_[size_t(level)][region] = float(std::clamp(lambda, 0.0, 1.0));
      s = {s.xy * kMemory, s.xx * kMemory, s.yy * kMemory};
    }
    if (all.xx > 0) explained += std::max(0.0, all.xy) * all.xy / all.xx;
    total += all.yy;
  }
  worthwhile_ = explained > kWorthwhile * total;
}

}  // namespace kairos
