// The oracle: the definition of the image, one ray and one sample at a time, without skipping, lists or SIMD.
#pragma once

#include <vector>

#include "raycast/render_settings.h"
#include "volume/brick_volume.h"

namespace kairos {

/// Renders every pixel in double precision (classification nodes are floats, as everywhere). Row-major,
/// `channels()` values a pixel, top row first: what a tile's pixels hold before `finishPixels` (see frame.h).
/// Slow; for tests and accuracy benchmarks.
std::vector<double> castReference(const RenderSettings& settings, const BrickVolume& volume);

}  // namespace kairos
