// From tiles' pixels to images.
#pragma once

#include <cstdint>

#include "core/image.h"
#include "raycast/tile_kernel.h"

namespace kairos {

/// Bit l stands for lane l of a tile.
inline constexpr uint32_t kAllTileLanes = (1u << kLanes) - 1;

/// Writes one tile's pixels (channels x 16 floats) into `rgba` and, where there is a depth channel, `depth`.
/// Projections (mip, average) are classified here. Lanes that are not among `lanes` keep what they show.
/// Returns how many pixels of `rgba` changed.
int writeTile(const RenderSettings& settings, const ClassificationTable& table, const TileRays& rays,
              double background, int tileX, int tileY, const float* pixels, Image& rgba, Image* depth,
              uint32_t lanes = kAllTileLanes);

}  // namespace kairos
