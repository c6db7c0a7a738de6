// From tiles' pixels to images.
#pragma once

#include "core/image.h"
#include "raycast/tile_kernel.h"

namespace kairos {

/// Writes one tile's pixels (channels x 16 floats) into `rgba` and, where there is a depth channel, `depth`.
/// Projections (mip, average) are classified here. Returns how many pixels of `rgba` changed.
int writeTile(const RenderSettings& settings, const ClassificationTable& table, const TileRays& rays,
              double background, int tileX, int tileY, const float* pixels, Image& rgba, Image* depth);

}  // namespace kairos
