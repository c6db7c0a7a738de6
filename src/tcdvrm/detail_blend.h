// How much of the previous image's detail the new one still has.
#pragma once

#include <array>
#include <vector>

#include "tcdvrm/float4.h"
#include "tcdvrm/live_blocks.h"

namespace kairos {

/// Where the image between cast nodes is interpolated, the previous image knows what an interpolation misses:
/// lambda times that detail is added. Lambda is regressed, level by level and in regions of 64x64 pixels, at
/// nodes that were cast, from the residuals of the same cubic in the new image and in the previous one. It is
/// shrunk to the whole image's value, forgets by half a frame, and stays within [0, 1]: regions of 16 pixels,
/// or residuals of a linear interpolation, have been measured to do harm.
class DetailBlend {
 public:
  static constexpr int kRegionEdge = 64;
  static constexpr int kLevels = 2;  // of the nodes found: strides 1 and 2

  DetailBlend(int imageWidth, int imageHeight);

  /// Makes the last frame's observations this frame's lambdas.
  void beginFrame();
  /// Would blending take away so much of the error that it is worth its time?
  bool worthwhile() const { return worthwhile_; }
  /// Has the old image detail of a block that rays found, at level 0 or 1? What it has otherwise is itself
  /// interpolated, and not worth a share in the new one. All have, to begin with.
  void setFresh(int level, size_t block, bool fresh) { fresh_[size_t(level)][block] = fresh; }
  bool fresh(int level, size_t block) const { return fresh_[size_t(level)][block] != 0; }

  /// `x` and `y` in pixels; level 0 or 1.
  float lambda(int level, int x, int y) const {
    return fresh(level, blocks_.blockAt(x, y)) ? lambdas_[size_t(level)][regionAt(x, y)] : 0;
  }

  void observe(int level, int x, int y, Float4 newResidual, Float4 oldResidual) {
    Sums& s = sums_[size_t(level)][regionAt(x, y)];
    s.xy += double(sum4(newResidual * oldResidual));
    s.xx += double(sum4(oldResidual * oldResidual));
    s.yy += double(sum4(newResidual * newResidual));
  }

 private:
  struct Sums {
    double xy = 0, xx = 0, yy = 0;
  };
  size_t regionAt(int x, int y) const {
    return size_t(y / kRegionEdge) * size_t(columns_) + size_t(x / kRegionEdge);
  }

  int columns_;
  BlockSet blocks_;  // an empty one of the image's size
  std::array<std::vector<uint8_t>, kLevels> fresh_;
  std::array<std::vector<Sums>, kLevels> sums_;
  std::array<std::vector<float>, kLevels> lambdas_;
  bool worthwhile_ = false;
};

}  // namespace kairos
