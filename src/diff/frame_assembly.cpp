#include "diff/frame_assembly.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace kairos {
namespace {

using Four [[gnu::vector_size(16)]] = float;
using FourBits [[gnu::vector_size(16)]] = uint32_t;

Four load(const float* from) {
  Four v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// The colours of four pixels from four channels.
void transpose(const Four (&channels)[4], Four (&colours)[4]) {
  const Four rg01 = __builtin_shufflevector(channels[0], channels[1], 0, 4, 1, 5);
  const Four rg23 = __builtin_shufflevector(channels[0], channels[1], 2, 6, 3, 7);
  const Four ba01 = __builtin_shufflevector(channels[2], channels[3], 0, 4, 1, 5);
  const Four ba23 = __builtin_shufflevector(channels[2], channels[3], 2, 6, 3, 7);
  colours[0] = __builtin_shufflevector(rg01, ba01, 0, 1, 4, 5);
  colours[1] = __builtin_shufflevector(rg01, ba01, 2, 3, 6, 7);
  colours[2] = __builtin_shufflevector(rg23, ba23, 0, 1, 4, 5);
  colours[3] = __builtin_shufflevector(rg23, ba23, 2, 3, 6, 7);
}

// The usual tile: dvr without depth, entirely on the image.
int writeWholeTile(int tileX, int tileY, const float* pixels, Image& rgba) {
  int changed = 0;
  for (int row = 0; row < kTileEdge; ++row, pixels += kTileEdge) {
    const Four channels[4] = {load(pixels), load(pixels + kLanes), load(pixels + 2 * kLanes),
                              load(pixels + 3 * kLanes)};
    Four colours[4];
    transpose(channels, colours);
    float* out = rgba.pixel(tileX * kTileEdge, tileY * kTileEdge + row);
    for (int x = 0; x < kTileEdge; ++x, out += 4) {
      const FourBits differ = FourBits(load(out)) ^ FourBits(colours[x]);
      uint64_t halves[2];
      std::memcpy(halves, &differ, sizeof halves);
      changed += (halves[0] | halves[1]) != 0;
      std::memcpy(out, &colours[x], sizeof colours[x]);
    }
  }
  return changed;
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
