// One view of a scene, tile by tile.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "raycast/scene_state.h"
#include "raycast/segment_index.h"
#include "raycast/tile_kernel.h"

namespace kairos {

/// A tile made ready for a kernel; reused from tile to tile so that nothing is allocated.
struct PreparedTile {
  TileRays rays;
  std::span<const Segment> segments;
  std::vector<Segment> listed;  // what `segments` shows where no list is kept
};

/// kept: a view's segments are listed once. walked: anew for every tile that is cast, for few rays of many
/// views.
enum class SegmentLists { kept, walked };

/// The rays of a view and their segments. View and lattice are fixed, so they are found once; immutable but
/// for `buildBrickIndex`, safe to share between threads.
class TileCaster {
 public:
  TileCaster(const RenderSettings& settings, const BrickVolume& volume, ThreadPool& pool,
             const RayLattice& rays = {}, SegmentLists lists = SegmentLists::kept);

  const ViewRays& view() const { return view_; }
  /// Null where the lists are walked: because that was asked for, or since they would take too much memory.
  const SegmentIndex* index() const { return index_ ? &*index_ : nullptr; }
  void buildBrickIndex(const BrickVolume& volume, ThreadPool& pool);
  /// Does any ray meet the volume's bounds (and the clip box)? Not known where walked lists were asked for.
  bool seesVolume() const { return seesVolume_; }

  /// Finds a tile's segments. False when nothing in them is visible, so that all pixels are zero (dvr); its
  /// rays are made only otherwise.
  bool prepare(const KernelScene& scene, int tile, PreparedTile& prepared) const;

  /// Casts one tile as it stands, without a cache. `pixels` receives RenderSettings::pixelPlanes() x 16
  /// floats.
  void cast(const KernelScene& scene, TileKernel kernel, int tile, float* pixels, PreparedTile& scratch,
            TileCounters& counters) const;

 private:
  ViewRays view_;
  std::optional<SegmentIndex> index_;
  Vec3i gridSize_;
  size_t pixelFloats_;
  bool seesVolume_ = false;
};

}  // namespace kairos
