// The colours of a packet's rays.
#pragma once

#include "raycast/tile_caster.h"
#include "tcdvrm/float4.h"

namespace kairos {

/// A unit of an image: 16x16 pixels, what a packet of rays 4 pixels apart covers.
inline constexpr int kUnitEdge = kTileEdge * 4;

/// RGBA by RGBA.
struct PacketColours {
  float rgba[kLanes][4];
};

inline float squaredDistance(const float* rgba, Float4 other) {
  const Float4 d = load4(rgba) - other;
  return sum4(d * d);
}

/// Summed over all rays and channels.
inline double squaredDistance(const PacketColours& a, const PacketColours& b) {
  double sum = 0;
  for (int lane = 0; lane < kLanes; ++lane) sum += double(squaredDistance(a.rgba[lane], load4(b.rgba[lane])));
  return sum;
}

/// Casts one tile of a view (dvr).
inline void castColours(const TileCaster& caster, const KernelScene& scene, TileKernel kernel, int tile,
                        PacketColours& colours, PreparedTile& scratch, TileCounters& counters) {
  alignas(64) float planes[5 * kLanes];
  caster.cast(scene, kernel, tile, planes, scratch, counters);
  for (int lane = 0; lane < kLanes; ++lane)
    for (int c = 0; c < 4; ++c) colours.rgba[lane][c] = planes[c * kLanes + lane];
}

}  // namespace kairos
