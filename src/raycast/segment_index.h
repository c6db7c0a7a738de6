// The segments of a view: which bricks each tile's samples belong to, front to back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "raycast/tile_rays.h"

namespace kairos {

/// The samples [kBegin, kEnd) of a tile that one brick owns. Where the tile is not packet-owned, a lane's
/// share is the part of them between its own crossings of the brick's faces.
struct Segment {
  uint32_t cell;
  int32_t kBegin, kEnd;
};

/// Lists a tile's segments front to back (for each of its rays). Appends to `segments`.
void listSegments(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                  std::vector<Segment>& segments);

/// The sub-blocks of its brick that a segment's samples may read, one bit each; never misses one.
uint64_t touchedSubBlocks(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                          const Segment& segment);

/// The windows of its brick (see kWindows) in which footprints of a segment's samples start; never misses
/// one. While none of them is visible the segment adds exactly nothing.
uint64_t touchedWindows(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                        const Segment& segment);

/// All segments of a view, tile by tile, and the way back from bricks to segments.
class SegmentIndex {
 public:
  SegmentIndex(const ViewRays& view, const BrickVolume& volume, ThreadPool& pool);

  size_t segmentCount() const { return segments_.size(); }
  bool empty() const { return segments_.empty(); }
  /// First segment of a tile; tile + 1 gives the end.
  size_t begin(int tile) const { return tileBegin_[size_t(tile)]; }
  std::span<const Segment> segments(int tile) const {
    return {segments_.data() + begin(tile), begin(tile + 1) - begin(tile)};
  }
  const Segment& segment(size_t i) const { return segments_[i]; }

  /// Restores what never changes about a tile's rays: sample ranges and ownership.
  void rays(const ViewRays& view, int tile, TileRays& rays) const;

  /// Builds the brick -> segment index; needed by `segmentsOf` and the two below, not by a full render.
  void buildBrickIndex(const ViewRays& view, const BrickVolume& volume, ThreadPool& pool);
  bool hasBrickIndex() const { return !cellBegin_.empty(); }
  std::span<const uint32_t> segmentsOf(uint32_t cell) const {
    return {cellSegments_.data() + cellBegin_[cell], cellBegin_[cell + 1] - cellBegin_[cell]};
  }
  uint64_t subBlocks(size_t segment) const { return subBlocks_[segment]; }
  uint32_t tileOf(size_t segment) const { return tileOf_[segment]; }

  uint64_t memoryBytes() const;

 private:
  std::vector<uint64_t> tileBegin_;
  std::vector<TileSampling> sampling_;
  std::vector<Segment> segments_;
  std::vector<uint64_t> cellBegin_;
  std::vector<uint32_t> cellSegments_, tileOf_;
  std::vector<uint64_t> subBlocks_;
};

}  // namespace kairos
