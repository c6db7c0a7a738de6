// The oracle: the definition of the image, one ray and one sample at a time, without skipping, lists or SIMD.
#pragma once

#include <vector>

#include "raycast/render_settings.h"
#include "raycast/tile_kernel.h"
#include "volume/brick_volume.h"

namespace kairos {

/// Renders in double precision (classification nodes are floats, as everywhere). Slow; for tests and accuracy
/// benchmarks.
class ReferenceCaster {
 public:
  /// The volume must outlive the object and stay as it is.
  ReferenceCaster(const RenderSettings& settings, const BrickVolume& volume);
  ReferenceCaster(const ReferenceCaster&) = delete;
  ReferenceCaster& operator=(const ReferenceCaster&) = delete;

  const ViewRays& view() const { return view_; }
  /// What a tile's pixels hold before `finishPixels` (see frame.h): `channels()` values a lane.
  void cast(int tile, double* pixels, TileCounters& counters) const;

 private:
  RenderSettings settings_;
  ClassificationTable table_;
  Occupancy occupancy_;  // empty: never skips
  SlabLevels levels_;
  ViewRays view_;
  KernelScene scene_;
};

/// Every pixel, row-major, top row first.
std::vector<double> castReference(const RenderSettings& settings, const BrickVolume& volume);

}  // namespace kairos
