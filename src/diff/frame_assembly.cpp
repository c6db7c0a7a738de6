#include "diff/frame_assembly.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace kairos {
namespace {

// The colour of one lane's pixel.
std::array<float, 4> colourOf(const RenderSettings& settings, const ClassificationTable& table, const TileRays& rays,
                              double background, const float* pixels, int lane) {
  if (settings.mode == RenderMode::dvr)
    return {pixels[lane], pixels[kLanes + lane], pixels[2 * kLanes + lane], pixels[3 * kLanes + lane]};
  const int32_t samples = rays.kEnd[lane] - rays.kBegin[lane];
  if (samples <= 0) return {};
  const float value = settings.mode == RenderMode::mip ? pixels[lane] : float(background) + pixels[lane] / float(samples);
  return table.classify(value);
}

}  // namespace

int writeTile(const RenderSettings& settings, const ClassificationTable& table, const TileRays& rays, double background,
              int tileX, int tileY, const float* pixels, Image& rgba, Image* depth) {
  int changed = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = tileX * kTileEdge + lane % kTileEdge, y = tileY * kTileEdge + lane / kTileEdge;
    if (x >= rgba.width || y >= rgba.height) continue;
    const std::array<float, 4> colour = colourOf(settings, table, rays, background, pixels, lane);
    float* out = rgba.pixel(x, y);
    if (std::memcmp(out, colour.data(), sizeof colour) != 0) {
      std::memcpy(out, colour.data(), sizeof colour);
      ++changed;
    }
    if (depth) {
      const float alpha = colour[3];
      *depth->pixel(x, y) = alpha > 0 ? pixels[4 * kLanes + lane] / alpha : std::numeric_limits<float>::infinity();
    }
  }
  return changed;
}

}  // namespace kairos
