// Casting whole rays anew, in packets, for the methods that decide pixel by pixel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image.h"
#include "diff/frame_renderer.h"
#include "raycast/tile_caster.h"

namespace kairos {

/// Casts 4x4 tiles and writes what they show, in all their pixels or in chosen ones. A pixel that is written
/// has the bits of a full render.
class PixelRecast {
 public:
  /// Tiles are written to `rgba` and, unless null, `depth`; all three must outlive the object.
  PixelRecast(const SceneState& scene, const RendererOptions& options, Image& rgba, Image* depth);

  /// All tiles, in an order in which neighbours share bricks that are still in cache.
  const std::vector<uint32_t>& allTiles() const { return tileOrder_; }
  /// Those of them with a pixel whose number (one per pixel, row by row) is above 0. Valid until the next
  /// call.
  const std::vector<uint32_t>& tilesOf(std::span<const int32_t> numbers);

  /// Sampling points S along the rays of a tile's packet, in bricks that are visible now; what lies behind
  /// opaque matter counts too.
  uint64_t rayPoints(uint32_t tile) const;
  /// The same of every single ray, as an image of one channel (the paper's figure 2).
  Image rayPointsOfPixels() const;

  /// Casts the tiles. `only`, one number per pixel, leaves pixels unwritten where it is 0; empty writes all.
  /// Adds to the counts and times of `statistics`; writing counts as casting.
  void cast(std::span<const uint32_t> tiles, std::span<const int32_t> only, FrameStatistics& statistics);

  /// Counts a step, for the age of pixels.
  void beginStep() { ++step_; }
  /// Steps since each pixel was written, as an image of one channel.
  Image stepsSinceWritten() const;

  const TileCaster& caster() const { return caster_; }
  uint64_t memoryBytes() const { return caster_.index() ? caster_.index()->memoryBytes() : 0; }

 private:
  struct Counts;
  const ViewRays& view() const { return caster_.view(); }
  template <class Visit>
  void forEachPixel(size_t tile, Visit&& visit) const;
  uint32_t writtenLanes(uint32_t tile, std::span<const int32_t> only) const;
  uint64_t rayPointsOfLane(const PreparedTile& tile, int lane) const;
  void castTile(uint32_t tile, uint32_t lanes, std::vector<float>& pixels, PreparedTile& prepared,
                Counts& counts);

  const SceneState& scene_;
  int tilesPerTask_;
  Image& rgba_;
  Image* depth_;
  TileCaster caster_;
  std::vector<uint32_t> tileOrder_, chosen_;
  uint32_t step_ = 0;
  std::vector<uint32_t> written_;   // per pixel: at which step
  std::vector<uint8_t> hasNumber_;  // per tile, scratch of `tilesOf`
};

}  // namespace kairos
