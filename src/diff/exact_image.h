// The exact image of a changing scene, brought up to date where and when its user asks for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/image.h"
#include "diff/frame_renderer.h"
#include "diff/segment_cache.h"
#include "raycast/tile_caster.h"

namespace kairos {

/// Which 4x4 tiles of a view still show the scene as it is, which do not, and the means to cast the latter
/// anew: all of a tile, or through a cache of segments only what changes touched. A tile that was cast has
/// the bits of a full render.
///
/// Finding out what changes touch comes in two parts, so that whoever knows that everything changed can leave
/// out the second: `note` keeps which parts of which bricks changed, `mark` turns that into segments and
/// tiles.
class ExactImage {
 public:
  /// What is kept from frame to frame besides the image.
  struct Keeps {
    bool segments = true;  // without them every change makes every tile stale, and nothing is reused
    bool pixels = false;   // of tiles, for `show`
  };
  /// Tiles are written to `rgba` and, unless null, `depth`; all three must outlive the object.
  ExactImage(const SceneState& scene, const RendererOptions& options, Keeps keeps, Image& rgba, Image* depth);

  /// After SceneState::start: every tile is stale.
  void restart();
  /// Takes in one step's changes; may be called for several steps before `mark`.
  void note(const AppliedChanges& changes);
  /// Makes the tiles stale that read what was noted. Returns how many segments were not stale on that account
  /// before.
  uint64_t mark();
  /// Makes every tile stale; what was noted stays noted.
  void markAll();

  bool stale(uint32_t tile) const { return stale_[tile] != 0; }
  /// Is it stale on account of what was marked last?
  bool touched(uint32_t tile) const { return stale_[tile] == kTouched; }
  /// All stale tiles, in the order in which they are best cast.
  const std::vector<uint32_t>& staleTiles();
  /// Lattice samples of a tile that casting it now would integrate, were no ray to end before its last
  /// frame's did and no window to be skipped: an upper estimate to be scaled by experience. After `mark`.
  uint64_t latticeSamples(uint32_t tile) const;
  /// Lattice samples of all bricks that changes touched while visible, and of all visible ones: what can be
  /// known before `mark`. Both count what lies behind opaque matter. 0 without segments.
  struct Reach {
    uint64_t touched = 0, visible = 0;
  };
  Reach reachOf(const AppliedChanges& changes) const;
  /// Did one step's changes reach so many of the visible samples that looking for the others cannot pay?
  bool changesNearlyAll(const AppliedChanges& changes) const;

  /// Casts the tiles (after `mark`) and writes them to the images; they are exact then. Adds to the counts
  /// and times of `statistics`.
  void cast(std::span<const uint32_t> tiles, FrameStatistics& statistics);
  /// The same for all tiles and without the cache, whatever was marked or noted; nothing of it is reused
  /// afterwards.
  void castAll(FrameStatistics& statistics);
  /// Writes tiles that were cast earlier to the images once more. Only where pixels are kept.
  void show(std::span<const uint32_t> tiles);

  const TileCaster& caster() const { return caster_; }
  int tileCount() const { return caster_.view().tileCount(); }
  uint64_t cacheBytes() const { return cache_ ? cache_->bytes() : 0; }
  uint64_t memoryBytes() const;

 private:
  const RenderSettings& settings() const { return scene_.settings(); }
  static constexpr uint8_t kTouched = 2;

  float* keptPixels(uint32_t tile) { return pixels_.data() + size_t(tile) * pixelFloats_; }
  void forgetNotes();
  void castTile(uint32_t tile, bool throughCache, PreparedTile& prepared, float* pixels,
                TileCounters& counters);
  uint64_t write(uint32_t tile, const TileRays& rays, const float* pixels);
  void cast(std::span<const uint32_t> tiles, bool throughCache, FrameStatistics& statistics);
  bool chooseCache(uint32_t tile, std::span<const Segment> segments, uint8_t* flags);

  const SceneState& scene_;
  const RendererOptions options_;
  Image& rgba_;
  Image* depth_;
  TileCaster caster_;
  std::unique_ptr<SegmentCache> cache_;  // null: nothing is reused
  size_t pixelFloats_;
  std::vector<uint32_t> tileOrder_, staleTiles_;
  std::vector<uint8_t> stale_;
  std::vector<uint32_t> reach_;  // how many of a tile's segments its last cast looked at
  std::vector<float> pixels_;    // tile by tile, pixelPlanes x 16; empty: not kept
  std::vector<uint64_t> noted_;  // per cell: sub-blocks that changed while it was visible
  std::vector<uint32_t> notedCells_;
  std::vector<uint64_t> cellSamples_;  // per cell: lattice samples of its segments
  std::atomic<uint64_t> tilesUncached_{0};
};

}  // namespace kairos
