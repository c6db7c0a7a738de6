#include "diff/exact_image.h"

#include <algorithm>
#include <mutex>
#include <numeric>

#include "core/stopwatch.h"
#include "diff/frame_assembly.h"
#include "raycast/morton.h"

namespace kairos {
namespace {

std::vector<uint32_t> orderTiles(const ViewRays& view, RendererOptions::TileOrder order) {
  // Neighbouring tiles share bricks, which are still in cache.
  if (order == RendererOptions::TileOrder::morton) return mortonOrder(view.tilesX(), view.tilesY());
  std::vector<uint32_t> tiles(static_cast<size_t>(view.tileCount()));
  std::iota(tiles.begin(), tiles.end(), 0u);
  if (order == RendererOptions::TileOrder::reversed) std::reverse(tiles.begin(), tiles.end());
  return tiles;
}

// A tile is recast whole, without touching the cache, when changes touched at least so much of its visible
// samples: filling the cache would cost more than it could save.
constexpr double kRecastShare = 0.8;

constexpr int kMostPixelPlanes = 6;  // RenderSettings::pixelPlanes

uint64_t latticeSamplesOf(const Segment& s) {
  return uint64_t(s.kEnd - s.kBegin) * kLanes;
}

}  // namespace

ExactImage::ExactImage(const SceneState& scene, const RendererOptions& options, Keeps keeps, Image& rgba,
                       Image* depth)
    : scene_(scene),
      options_(options),
      rgba_(rgba),
      depth_(depth),
      caster_(scene.settings(), scene.volume(), scene.pool()),
      pixelFloats_(size_t(scene.settings().pixelPlanes()) * kLanes),
      tileOrder_(orderTiles(caster_.view(), options.tileOrder)) {
  if (keeps.segments) caster_.buildBrickIndex(scene.volume(), scene.pool());
  const auto tiles = size_t(tileCount());
  stale_.assign(tiles, 1);
  reach_.assign(tiles, 0);
  if (keeps.pixels) pixels_.assign(tiles * pixelFloats_, 0.0f);
  noted_.assign(scene.volume().cellCount(), 0);
  if (const SegmentIndex* index = caster_.index(); index && index->hasBrickIndex()) {
    cellSamples_.assign(noted_.size(), 0);
    for (size_t s = 0; s < index->segmentCount(); ++s)
      cellSamples_[index->segment(s).cell] += latticeSamplesOf(index->segment(s));
  }
}

void ExactImage::restart() {
  if (const SegmentIndex* index = caster_.index(); index && index->hasBrickIndex())
    cache_ = std::make_unique<SegmentCache>(*index, tileCount(), settings().channels(), options_.cacheMemory);
  forgetNotes();
  markAll();
}

void ExactImage::forgetNotes() {
  for (const uint32_t cell : notedCells_) noted_[cell] = 0;
  notedCells_.clear();
}

void ExactImage::markAll() {
  std::fill(stale_.begin(), stale_.end(), kTouched);
}

void ExactImage::note(const AppliedChanges& changes) {
  if (!cache_) return markAll();
  for (size_t i = 0; i < changes.cells.size(); ++i) {
    const uint32_t cell = changes.cells[i];
    if (!changes.visibleBefore[i] && !scene_.occupancy().visible(cell)) continue;
    if (noted_[cell] == 0 && changes.subBlocks[i] != 0) notedCells_.push_back(cell);
    noted_[cell] |= changes.subBlocks[i];
  }
}

// Flags the segments that read changed voxels of bricks that were or are visible, and their tiles.
uint64_t ExactImage::mark() {
  if (!cache_) return 0;
  const SegmentIndex& index = *caster_.index();
  std::replace(stale_.begin(), stale_.end(), kTouched, uint8_t(1));
  std::atomic<uint64_t> marked{0};
  scene_.pool().forEach(notedCells_.size(), 16, [&](size_t begin, size_t end) {
    uint64_t count = 0;
    for (size_t i = begin; i < end; ++i) {
      const uint32_t cell = notedCells_[i];
      for (const uint32_t segment : index.segmentsOf(cell)) {
        if ((index.subBlocks(segment) & noted_[cell]) == 0) continue;
        count += cache_->touch(segment);
        std::atomic_ref(stale_[index.tileOf(segment)]).store(kTouched, std::memory_order_relaxed);
      }
      noted_[cell] = 0;
    }
    marked.fetch_add(count, std::memory_order_relaxed);
  });
  notedCells_.clear();
  return marked;
}

const std::vector<uint32_t>& ExactImage::staleTiles() {
  staleTiles_.clear();
  for (const uint32_t tile : tileOrder_)
    if (stale_[tile]) staleTiles_.push_back(tile);
  return staleTiles_;
}

uint64_t ExactImage::latticeSamples(uint32_t tile) const {
  const SegmentIndex& index = *caster_.index();
  const auto segments = index.segments(int(tile));
  const uint8_t* flags = cache_->flags(index.begin(int(tile)));
  uint64_t samples = 0;
  for (size_t s = 0; s < segments.size() && s < reach_[tile]; ++s)
    if (flags[s] != SegmentCache::fresh && scene_.occupancy().visible(segments[s].cell))
      samples += latticeSamplesOf(segments[s]);
  return samples;
}

ExactImage::Reach ExactImage::reachOf(const AppliedChanges& changes) const {
  Reach reach;
  for (uint32_t cell = 0; cell < cellSamples_.size(); ++cell)
    if (scene_.occupancy().visible(cell)) reach.visible += cellSamples_[cell];
  for (size_t i = 0; i < changes.cells.size() && !cellSamples_.empty(); ++i)
    if (changes.visibleBefore[i] || scene_.occupancy().visible(changes.cells[i]))
      reach.touched += cellSamples_[changes.cells[i]];
  return reach;
}

// By the bricks that lie wholly in the domain: of the others only a part can change.
bool ExactImage::changesNearlyAll(const AppliedChanges& changes) const {
  if (!cache_) return false;
  constexpr double kNearlyAll = 0.95;
  const VoxelBox& domain = scene_.volume().lattice().domain;
  const auto samples = [&](uint32_t cell) -> uint64_t {
    if (!scene_.occupancy().visible(cell)) return 0;
    const Vec3i lo = scene_.volume().cellOrigin(cell);
    return domain.contains({lo, lo + Vec3i{kBrickEdge, kBrickEdge, kBrickEdge}}) ? cellSamples_[cell] : 0;
  };
  uint64_t touched = 0, visible = 0;
  for (size_t i = 0; i < changes.cells.size(); ++i)
    if (changes.subBlocks[i] == ~uint64_t(0)) touched += samples(changes.cells[i]);
  if (touched == 0) return false;
  for (uint32_t cell = 0; cell < cellSamples_.size(); ++cell) visible += samples(cell);
  return double(touched) >= kNearlyAll * double(visible);
}

// Decides whether a tile goes through the cache, and turns the marks since its last cast into plain stale
// ones. What lay behind the end of all rays in the last frame has no say: most likely it still does.
bool ExactImage::chooseCache(uint32_t tile, std::span<const Segment> segments, uint8_t* flags) {
  uint64_t visible = 0, touched = 0;
  size_t visibleSegments = 0;
  for (size_t s = 0; s < segments.size(); ++s) {
    const bool touchedNow = flags[s] == SegmentCache::touched;
    if (touchedNow) flags[s] = SegmentCache::stale;
    if (!scene_.occupancy().visible(segments[s].cell)) continue;
    ++visibleSegments;
    if (s >= reach_[tile]) continue;
    const uint64_t samples = latticeSamplesOf(segments[s]);
    visible += samples;
    if (touchedNow) touched += samples;
  }
  if (touched > 0 && double(touched) >= kRecastShare * double(visible)) return false;
  return cache_->reserve(int(tile), visibleSegments);
}

void ExactImage::castTile(uint32_t tile, bool throughCache, PreparedTile& prepared, float* pixels,
                          TileCounters& counters) {
  const SegmentIndex* index = caster_.index();
  if (!caster_.prepare(scene_.kernelScene(), int(tile), prepared)) {
    std::fill_n(pixels, pixelFloats_, 0.0f);
    counters.segmentsSkipped += prepared.segments.size();
    reach_[tile] = uint32_t(prepared.segments.size());
    if (cache_) SegmentCache::forgetMarks(cache_->flags(index->begin(int(tile))), prepared.segments.size());
    return;
  }
  TileTask task{
      &prepared.rays, prepared.segments.data(), uint32_t(prepared.segments.size()), nullptr, nullptr, pixels};
  if (cache_) {
    const size_t first = index->begin(int(tile));
    if (throughCache && chooseCache(tile, prepared.segments, cache_->flags(first))) {
      task.partials = cache_->partials(first);
      task.stale = cache_->flags(first);
    } else {
      tilesUncached_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  const uint64_t before = counters.segmentsComposited + counters.segmentsSkipped;
  scene_.kernel()(scene_.kernelScene(), task, counters);
  reach_[tile] = uint32_t(counters.segmentsComposited + counters.segmentsSkipped - before);
}

void ExactImage::cast(std::span<const uint32_t> tiles, FrameStatistics& statistics) {
  cast(tiles, true, statistics);
}

void ExactImage::castAll(FrameStatistics& statistics) {
  if (cache_) cache_->invalidate();
  forgetNotes();
  markAll();
  cast(staleTiles(), false, statistics);
}

void ExactImage::cast(std::span<const uint32_t> tiles, bool throughCache, FrameStatistics& statistics) {
  Stopwatch clock;
  TileCounters total;
  std::mutex totalMutex;
  tilesUncached_ = 0;
  scene_.pool().forEach(tiles.size(), size_t(options_.tilesPerTask), [&](size_t begin, size_t end) {
    TileCounters counters;
    PreparedTile prepared;
    alignas(64) float scratch[kMostPixelPlanes * kLanes];
    uint64_t changed = 0;
    for (size_t i = begin; i < end; ++i) {
      const uint32_t tile = tiles[i];
      float* pixels = pixels_.empty() ? scratch : keptPixels(tile);
      castTile(tile, throughCache, prepared, pixels, counters);
      // At once, while they are at hand.
      changed += write(tile, prepared.rays, pixels);
      stale_[tile] = 0;
    }
    std::lock_guard lock(totalMutex);
    total += counters;
    statistics.pixelsChanged += changed;
  });
  statistics.castMs += clock.lap();
  for (const uint32_t tile : tiles) statistics.pixelsRecast += uint64_t(caster_.view().raysOf(int(tile)));
  statistics.raysCast = statistics.pixelsRecast;
  statistics.segmentsTotal =
      caster_.index() ? caster_.index()->segmentCount() : total.segmentsComposited + total.segmentsSkipped;
  statistics.segmentsRecast += total.segmentsIntegrated;
  statistics.samples += total.samples;
  statistics.gradients += total.gradients;
  statistics.tilesRecast += tiles.size();
  statistics.tilesUncached += tilesUncached_;
}

uint64_t ExactImage::write(uint32_t tile, const TileRays& rays, const float* pixels) {
  const int tilesX = caster_.view().tilesX();
  return uint64_t(writeTile(settings(), scene_.table(), rays, scene_.volume().background(),
                            int(tile) % tilesX, int(tile) / tilesX, pixels, rgba_, depth_));
}

void ExactImage::show(std::span<const uint32_t> tiles) {
  scene_.pool().forEach(tiles.size(), 256, [&](size_t begin, size_t end) {
    TileRays rays;
    for (size_t i = begin; i < end; ++i) {
      // How many samples each ray has.
      if (settings().mode != RenderMode::dvr) rays = caster_.view().rays(int(tiles[i]));
      write(tiles[i], rays, keptPixels(tiles[i]));
    }
  });
}

uint64_t ExactImage::memoryBytes() const {
  return (caster_.index() ? caster_.index()->memoryBytes() : 0) + cacheBytes() +
         pixels_.size() * sizeof(float);
}

}  // namespace kairos
