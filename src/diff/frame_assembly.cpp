#include "diff/frame_assembly.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace kairos {
namespace {

// The usual tile: dvr without depth, entirely on the image.
int writeWholeTile(int tileX, int tileY, const float* pixels, Image& rgba) {
  uint64_t changed = 0;
  for (int row = 0; row < kTileEdge; ++row) {
    float colours[kTileEdge][4];
    for (int x = 0; x < kTileEdge; ++x)
      for (int c = 0; c < 4; ++c) colours[x][c] = pixels[c * kLanes + row * kTileEdge + x];
    float* out = rgba.pixel(tileX * kTileEdge, tileY * kTileEdge + row);
    uint64_t before[2 * kTileEdge], after[2 * kTileEdge];
    std::memcpy(before, out, sizeof before);
    std::memcpy(after, colours, sizeof after);
    for (int x = 0; x < kTileEdge; ++x)
      changed += ((before[2 * x] ^ after[2 * x]) | (before[2 * x + 1] ^ after[2 * x + 1])) != 0;
    std::memcpy(out, colours, sizeof colours);
  }
  return int(changed);
}

// The colour of one lane's pixel.
std::array<float, 4> colourOf(const RenderSettings& settings, const ClassificationTable& table,
                              const TileRays& rays, double background, const float* pixels, int lane) {
  if (settings.mode == RenderMode::dvr)
    return {pixels[lane], pixels[kLanes + lane], pixels[2 * kLanes + lane], pixels[3 * kLanes + lane]};
  const int32_t samples = rays.kEnd[lane] - rays.kBegin[lane];
  if (samples <= 0) return {};
  const float value =
      settings.mode == RenderMode::mip ? pixels[lane] : float(background) + pixels[lane] / float(samples);
  return table.classify(value);
}

}  // namespace

int writeTile(const RenderSettings& settings, const ClassificationTable& table, const TileRays& rays,
              double background, int tileX, int tileY, const float* pixels, Image& rgba, Image* depth,
              uint32_t lanes) {
  if (lanes == kAllTileLanes && settings.mode == RenderMode::dvr && !depth &&
      (tileX + 1) * kTileEdge <= rgba.width && (tileY + 1) * kTileEdge <= rgba.height)
    return writeWholeTile(tileX, tileY, pixels, rgba);
  int changed = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = tileX * kTileEdge + lane % kTileEdge, y = tileY * kTileEdge + lane / kTileEdge;
    if (x >= rgba.width || y >= rgba.height || !(lanes >> lane & 1)) continue;
    const std::array<float, 4> colour = colourOf(settings, table, rays, background, pixels, lane);
    float* out = rgba.pixel(x, y);
    if (std::memcmp(out, colour.data(), sizeof colour) != 0) {
      std::memcpy(out, colour.data(), sizeof colour);
      ++changed;
    }
    if (depth) {
      const float alpha = colour[3];
      *depth->pixel(x, y) =
          alpha > 0 ? pixels[4 * kLanes + lane] / alpha : std::numeric_limits<float>::infinity();
    }
  }
  return changed;
}

}  // namespace kairos
