#include "raycast/tile_caster.h"

#include <algorithm>

namespace kairos {
namespace {

// Segment lists are kept while they are expected to take less than this; beyond it they are walked anew every
// frame.
constexpr uint64_t kMaxIndexSegments = uint64_t(1) << 27;

}  // namespace

TileCaster::TileCaster(const RenderSettings& settings, const BrickVolume& volume, ThreadPool& pool,
                       const RayLattice& rays, SegmentLists lists)
    : view_(settings, volume.lattice(), volume.gridOrigin(), rays),
      gridSize_(volume.gridSize()),
      pixelFloats_(size_t(settings.pixelPlanes()) * kLanes) {
  if (lists == SegmentLists::walked) return;
  const uint64_t expected = uint64_t(view_.tileCount()) * uint64_t(gridSize_.x + gridSize_.y + gridSize_.z);
  if (expected <= kMaxIndexSegments) {
    index_.emplace(view_, volume, pool);
    seesVolume_ = !index_->empty();
    return;
  }
  for (int tile = 0; tile < view_.tileCount() && !seesVolume_; ++tile) {
    const TileRays tileRays = view_.rays(tile);
    seesVolume_ = tileRays.firstSample() < tileRays.lastSample();
  }
}

void TileCaster::buildBrickIndex(const BrickVolume& volume, ThreadPool& pool) {
  if (index_) index_->buildBrickIndex(view_, volume, pool);
}

bool TileCaster::prepare(const KernelScene& scene, int tile, PreparedTile& prepared) const {
  if (!index_) {
    prepared.rays = view_.rays(tile);
    prepared.listed.clear();
    listSegments(view_, prepared.rays, gridSize_, prepared.listed);
    prepared.segments = prepared.listed;
    return true;
  }
  prepared.segments = index_->segments(tile);
  if (scene.mode == RenderMode::dvr &&
      std::none_of(prepared.segments.begin(), prepared.segments.end(),
                   [&](const Segment& s) { return scene.visible[s.cell] != 0; }))
    return false;
  index_->rays(view_, tile, prepared.rays);
  return true;
}

void TileCaster::cast(const KernelScene& scene, TileKernel kernel, int tile, float* pixels,
                      PreparedTile& scratch, TileCounters& counters) const {
  if (!prepare(scene, tile, scratch)) {
    std::fill_n(pixels, pixelFloats_, 0.0f);
    counters.segmentsSkipped += scratch.segments.size();
    return;
  }
  const TileTask task{
      &scratch.rays, scratch.segments.data(), uint32_t(scratch.segments.size()), nullptr, nullptr, pixels};
  kernel(scene, task, counters);
}

}  // namespace kairos
