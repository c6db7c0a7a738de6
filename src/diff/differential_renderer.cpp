#include "diff/differential_renderer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <mutex>
#include <string>

#include "core/error.h"
#include "diff/frame_assembly.h"
#include "diff/segment_cache.h"
#include "raycast/occupancy.h"

namespace kairos {
namespace {

class Stopwatch {
 public:
  /// Milliseconds since construction or the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Interleaves the bits of x and y: neighbours on the image stay neighbours in time, so their bricks are still
// in cache.
uint64_t mortonCode(uint32_t x, uint32_t y) {
  const auto spread = [](uint64_t v) {
    v = (v | v << 16) & 0x0000ffff0000ffffull;
    v = (v | v << 8) & 0x00ff00ff00ff00ffull;
    v = (v | v << 4) & 0x0f0f0f0f0f0f0f0full;
    v = (v | v << 2) & 0x3333333333333333ull;
    return (v | v << 1) & 0x5555555555555555ull;
  };
  return spread(x) | spread(y) << 1;
}

std::vector<uint32_t> orderTiles(const ViewRays& view, RendererOptions::TileOrder order) {
  std::vector<uint32_t> tiles(static_cast<size_t>(view.tileCount()));
  for (uint32_t i = 0; i < tiles.size(); ++i) tiles[i] = i;
  if (order == RendererOptions::TileOrder::reversed) std::reverse(tiles.begin(), tiles.end());
  if (order != RendererOptions::TileOrder::morton) return tiles;
  const auto width = uint32_t(view.tilesX());
  std::sort(tiles.begin(), tiles.end(), [&](uint32_t a, uint32_t b) {
    return mortonCode(a % width, a / width) < mortonCode(b % width, b / width);
  });
  return tiles;
}

// A tile is recast whole, without touching the cache, when this step touched at least so much of its visible
// samples: filling the cache would cost more than it could save.
constexpr double kRecastShare = 0.8;

// Segment lists are kept while they are expected to take less than this; beyond it they are walked anew every
// frame.
constexpr uint64_t kMaxIndexSegments = uint64_t(1) << 27;

}  // namespace

class DifferentialRenderer::Implementation {
 public:
  Implementation(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  const Image& start(const Field& field);
  const Image& update(const ChangedVoxels& changes);
  template <class T>
  const Image& render(const T* values, double tolerance);

  const Lattice lattice_;
  const RenderSettings settings_;
  const RendererOptions options_;
  ThreadPool pool_;
  ClassificationTable table_;
  std::unique_ptr<BrickVolume> volume_;
  Image image_, depth_;
  FrameStatistics statistics_;
  std::optional<uint64_t> state_;
  bool seesVolume_ = false;

  uint64_t memoryBytes() const;

 private:
  bool caching() const { return cache_ != nullptr; }
  void prepareView();
  void renderWhole(const Field& field);
  void renderChanges(const ChangedVoxels& changes);
  void castTiles(const std::vector<uint32_t>& tiles);
  void castTile(uint32_t tile, std::vector<Segment>& listed, TileCounters& counters);
  void clearTile(uint32_t tile);
  bool blank(std::span<const Segment> segments) const;
  bool chooseCache(uint32_t tile, std::span<const Segment> segments, uint8_t* flags);
  void assemble(const std::vector<uint32_t>& tiles);
  void mark(const DirtyBricks& dirty, const std::vector<uint8_t>& visibleBefore);
  void collectDirtyTiles();

  std::unique_ptr<ViewRays> view_;
  std::unique_ptr<SegmentIndex> index_;  // null: lists are walked anew every frame
  std::unique_ptr<SegmentCache> cache_;  // null: method full, or no index
  std::unique_ptr<Occupancy> occupancy_;
  KernelScene scene_{};
  TileKernel kernel_ = nullptr;
  std::vector<uint32_t> tileOrder_, dirtyTiles_;
  std::vector<uint8_t> tileDirty_, visibleBefore_;
  std::vector<uint32_t> tileReach_;  // how many of a tile's segments its last frame looked at
  std::vector<float> pixels_;        // tile by tile, pixelPlanes x 16
  std::atomic<uint64_t> tilesUncached_{0};
  std::unique_ptr<ChangeDetector>
      detector_;  // follows the arrays shown; none after a field or changes from elsewhere
  double detectorTolerance_ = 0;
};

DifferentialRenderer::Implementation::Implementation(const Lattice& lattice, const RenderSettings& settings,
                                                     const RendererOptions& options)
    : lattice_(lattice), settings_(settings), options_(options), pool_(options.threads) {
  settings_.validate();
  if (options.tilesPerTask < 1) throw OptionError("tilesPerTask", "expected at least 1");
  table_ = settings_.classification(lattice_);
  prepareView();
}

// What depends on the view and the lattice alone: rays, lists, cache.
void DifferentialRenderer::Implementation::prepareView() {
  // An empty volume has the grid of every later one: it depends on the domain only.
  Field empty;
  empty.background = lattice_.background;
  empty.values = makeVoxelArray(lattice_.type);
  volume_ = std::make_unique<BrickVolume>(lattice_, empty, pool_);
  view_ = std::make_unique<ViewRays>(settings_, lattice_, volume_->gridOrigin());
  const Vec3i grid = volume_->gridSize();
  const uint64_t expected = uint64_t(view_->tileCount()) * uint64_t(grid.x + grid.y + grid.z);
  if (expected <= kMaxIndexSegments) {
    index_ = std::make_unique<SegmentIndex>(*view_, *volume_, pool_);
    seesVolume_ = !index_->empty();
    if (options_.method == Method::segments) index_->buildBrickIndex(*view_, *volume_, pool_);
  } else {
    for (int tile = 0; tile < view_->tileCount() && !seesVolume_; ++tile) {
      const TileRays rays = view_->rays(tile);
      seesVolume_ = rays.firstSample() < rays.lastSample();
    }
  }
  tileOrder_ = orderTiles(*view_, options_.tileOrder);
  tileDirty_.assign(size_t(view_->tileCount()), 0);
  tileReach_.assign(size_t(view_->tileCount()), 0);
  pixels_.assign(size_t(view_->tileCount()) * size_t(settings_.pixelPlanes()) * kLanes, 0.0f);
  image_ = Image(settings_.width, settings_.height, 4);
  if (settings_.depth) {
    depth_ = Image(settings_.width, settings_.height, 1);
    std::fill(depth_.data.begin(), depth_.data.end(), std::numeric_limits<float>::infinity());
  }
}

const Image& DifferentialRenderer::Implementation::start(const Field& field) {
  renderWhole(field);
  detector_.reset();
  return image_;
}

const Image& DifferentialRenderer::Implementation::update(const ChangedVoxels& changes) {
  renderChanges(changes);
  detector_.reset();
  return image_;
}

void DifferentialRenderer::Implementation::renderWhole(const Field& field) {
  Stopwatch clock;
  volume_ = std::make_unique<BrickVolume>(lattice_, field, pool_);
  statistics_ = {};
  occupancy_ = std::make_unique<Occupancy>(settings_, table_);
  occupancy_->build(*volume_);
  scene_ = makeKernelScene(settings_, *volume_, table_, *occupancy_);
  kernel_ = settings_.kernel == Kernel::general ? generalKernel(scene_, settings_.isa)
                                                : fastestKernel(scene_, settings_.isa);
  state_ = stateChecksum(field);
  if (index_ && index_->hasBrickIndex())
    cache_ = std::make_unique<SegmentCache>(*index_, view_->tileCount(), settings_.channels(),
                                            options_.cacheMemory);
  statistics_.updateMs = clock.lap();
  castTiles(tileOrder_);
}

void DifferentialRenderer::Implementation::renderChanges(const ChangedVoxels& changes) {
  if (!occupancy_) throw StateError("changes were applied before any whole step was rendered");
  if (state_ && changes.stateBefore && *state_ != *changes.stateBefore)
    throw StateError(
        "the changes belong to another state of the volume than the one shown: their checksum before is " +
        std::to_string(*changes.stateBefore) + ", the volume's is " + std::to_string(*state_));
  Stopwatch clock;
  const DirtyBricks& dirty = volume_->apply(changes, pool_);
  statistics_ = {};
  state_ = changes.stateAfter;
  occupancy_->update(*volume_, dirty.cells, visibleBefore_);
  statistics_.voxelsChanged = changes.count();
  statistics_.updateMs = clock.lap();
  if (options_.method == Method::full || !index_) {
    castTiles(tileOrder_);
    return;
  }
  mark(dirty, visibleBefore_);
  collectDirtyTiles();
  statistics_.selectMs = clock.lap();
  castTiles(dirtyTiles_);
}

// Flags the segments that read changed voxels of bricks that were or are visible, and their tiles.
void DifferentialRenderer::Implementation::mark(const DirtyBricks& dirty,
                                                const std::vector<uint8_t>& visibleBefore) {
  std::atomic<uint64_t> marked{0};
  pool_.forEach(dirty.cells.size(), 16, [&](size_t begin, size_t end) {
    uint64_t count = 0;
    for (size_t i = begin; i < end; ++i) {
      const uint32_t cell = dirty.cells[i];
      if (!visibleBefore[i] && !occupancy_->visible(cell)) continue;
      for (const uint32_t segment : index_->segmentsOf(cell)) {
        if ((index_->subBlocks(segment) & dirty.subBlocks[i]) == 0) continue;
        count += cache_->touch(segment);
        std::atomic_ref(tileDirty_[index_->tileOf(segment)]).store(1, std::memory_order_relaxed);
      }
    }
    marked.fetch_add(count, std::memory_order_relaxed);
  });
  statistics_.segmentsDirty = marked;
}

void DifferentialRenderer::Implementation::collectDirtyTiles() {
  dirtyTiles_.clear();
  for (const uint32_t tile : tileOrder_)
    if (tileDirty_[tile]) {
      dirtyTiles_.push_back(tile);
      tileDirty_[tile] = 0;
    }
}

// A tile without anything visible: its pixels are zero, without casting a ray.
void DifferentialRenderer::Implementation::clearTile(uint32_t tile) {
  const size_t planes = size_t(settings_.pixelPlanes()) * kLanes;
  std::fill_n(pixels_.begin() + int64_t(tile * planes), planes, 0.0f);
}

bool DifferentialRenderer::Implementation::blank(std::span<const Segment> segments) const {
  return std::none_of(segments.begin(), segments.end(),
                      [&](const Segment& s) { return occupancy_->visible(s.cell); });
}

// Decides whether a tile goes through the cache, and turns this step's marks into plain stale ones. What lay
// behind the end of all rays in the last frame has no say: most likely it still does.
bool DifferentialRenderer::Implementation::chooseCache(uint32_t tile, std::span<const Segment> segments,
                                                       uint8_t* flags) {
  uint64_t visible = 0, touched = 0;
  for (size_t s = 0; s < segments.size(); ++s) {
    const bool touchedNow = flags[s] == SegmentCache::touched;
    if (touchedNow) flags[s] = SegmentCache::stale;
    if (s >= tileReach_[tile] || !occupancy_->visible(segments[s].cell)) continue;
    const auto length = uint64_t(segments[s].kEnd - segments[s].kBegin);
    visible += length;
    if (touchedNow) touched += length;
  }
  if (touched > 0 && double(touched) >= kRecastShare * double(visible)) return false;
  return cache_->reserve(int(tile), segments.size());
}

void DifferentialRenderer::Implementation::castTile(uint32_t tile, std::vector<Segment>& listed,
                                                    TileCounters& counters) {
  TileRays rays;
  std::span<const Segment> segments;
  if (index_) {
    segments = index_->segments(int(tile));
    if (settings_.mode == RenderMode::dvr && blank(segments)) {
      clearTile(tile);
      counters.segmentsSkipped += segments.size();
      tileReach_[tile] = uint32_t(segments.size());
      if (caching()) SegmentCache::forgetMarks(cache_->flags(index_->begin(int(tile))), segments.size());
      return;
    }
    index_->rays(*view_, int(tile), rays);
  } else {
    rays = view_->rays(int(tile));
    listed.clear();
    listSegments(*view_, rays, volume_->gridSize(), listed);
    segments = listed;
  }
  TileTask task{
      &rays,   segments.data(), uint32_t(segments.size()),
      nullptr, nullptr,         pixels_.data() + size_t(tile) * size_t(settings_.pixelPlanes()) * kLanes};
  if (caching()) {
    const size_t first = index_->begin(int(tile));
    if (chooseCache(tile, segments, cache_->flags(first))) {
      task.partials = cache_->partials(first);
      task.stale = cache_->flags(first);
    } else {
      tilesUncached_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  const uint64_t before = counters.segmentsComposited + counters.segmentsSkipped;
  kernel_(scene_, task, counters);
  tileReach_[tile] = uint32_t(counters.segmentsComposited + counters.segmentsSkipped - before);
}

void DifferentialRenderer::Implementation::castTiles(const std::vector<uint32_t>& tiles) {
  Stopwatch clock;
  TileCounters total;
  std::mutex totalMutex;
  tilesUncached_ = 0;
  pool_.forEach(tiles.size(), size_t(options_.tilesPerTask), [&](size_t begin, size_t end) {
    TileCounters counters;
    std::vector<Segment> listed;
    for (size_t i = begin; i < end; ++i) castTile(tiles[i], listed, counters);
    std::lock_guard lock(totalMutex);
    total += counters;
  });
  statistics_.castMs = clock.lap();
  assemble(tiles);
  statistics_.composeMs = clock.lap();
  statistics_.segmentsTotal =
      index_ ? index_->segmentCount() : total.segmentsComposited + total.segmentsSkipped;
  statistics_.segmentsRecast = total.segmentsIntegrated;
  statistics_.samples = total.samples;
  statistics_.gradients = total.gradients;
  statistics_.bricksVisible = occupancy_->visibleCount();
  statistics_.bricksSkipped = volume_->cellCount() - occupancy_->visibleCount();
  statistics_.tilesRecast = tiles.size();
  statistics_.tilesUncached = tilesUncached_;
  statistics_.cacheBytes = cache_ ? cache_->bytes() : 0;
}

void DifferentialRenderer::Implementation::assemble(const std::vector<uint32_t>& tiles) {
  std::atomic<uint64_t> changed{0}, recast{0};
  pool_.forEach(tiles.size(), 256, [&](size_t begin, size_t end) {
    TileRays rays;
    int changedHere = 0;
    uint64_t recastHere = 0;
    for (size_t i = begin; i < end; ++i) {
      const int tile = int(tiles[i]), x = tile % view_->tilesX(), y = tile / view_->tilesX();
      if (settings_.mode != RenderMode::dvr) rays = view_->rays(tile);  // how many samples each ray has
      changedHere += writeTile(settings_, table_, rays, volume_->background(), x, y,
                               pixels_.data() + size_t(tile) * size_t(settings_.pixelPlanes()) * kLanes,
                               image_, settings_.depth ? &depth_ : nullptr);
      recastHere += uint64_t(std::min(kTileEdge, settings_.width - x * kTileEdge)) *
                    uint64_t(std::min(kTileEdge, settings_.height - y * kTileEdge));
    }
    changed.fetch_add(uint64_t(changedHere), std::memory_order_relaxed);
    recast.fetch_add(recastHere, std::memory_order_relaxed);
  });
  statistics_.pixelsChanged = changed;
  statistics_.pixelsRecast = recast;
}

template <class T>
const Image& DifferentialRenderer::Implementation::render(const T* values, double tolerance) {
  if (elementTypeOf<T>() != lattice_.type)
    throw StateError("the array holds " + std::string(name(elementTypeOf<T>())) +
                     " values, the lattice says " + std::string(name(lattice_.type)));
  Field field = fieldFromDense(values, lattice_.domain.size(), T(lattice_.background), lattice_.domain.lo);
  if (!detector_ || tolerance != detectorTolerance_) {
    auto detector = std::make_unique<ChangeDetector>(field, tolerance);
    renderWhole(field);
    detector_ = std::move(detector);
    detectorTolerance_ = tolerance;
  } else {
    renderChanges(detector_->advance(std::move(field), pool_));
  }
  return image_;
}

uint64_t DifferentialRenderer::Implementation::memoryBytes() const {
  return (volume_ ? volume_->memoryBytes() : 0) + (index_ ? index_->memoryBytes() : 0) +
         (cache_ ? cache_->bytes() : 0) + pixels_.size() * sizeof(float);
}

DifferentialRenderer::DifferentialRenderer(const Lattice& lattice, const RenderSettings& settings,
                                           const RendererOptions& options)
    : impl_(std::make_unique<Implementation>(lattice, settings, options)) {}
DifferentialRenderer::~DifferentialRenderer() = default;
DifferentialRenderer::DifferentialRenderer(DifferentialRenderer&&) noexcept = default;

const Image& DifferentialRenderer::start(const Field& field) {
  return impl_->start(field);
}
const Image& DifferentialRenderer::update(const ChangedVoxels& changes) {
  return impl_->update(changes);
}
template <class T>
const Image& DifferentialRenderer::render(const T* values, double tolerance) {
  return impl_->render(values, tolerance);
}
template const Image& DifferentialRenderer::render(const uint8_t*, double);
template const Image& DifferentialRenderer::render(const uint16_t*, double);
template const Image& DifferentialRenderer::render(const float*, double);

const Image& DifferentialRenderer::image() const {
  return impl_->image_;
}
const Image& DifferentialRenderer::depth() const {
  return impl_->depth_;
}
const FrameStatistics& DifferentialRenderer::statistics() const {
  return impl_->statistics_;
}
bool DifferentialRenderer::seesVolume() const {
  return impl_->seesVolume_;
}
std::optional<uint64_t> DifferentialRenderer::state() const {
  return impl_->state_;
}
uint64_t DifferentialRenderer::memoryBytes() const {
  return impl_->memoryBytes();
}
const BrickVolume& DifferentialRenderer::volume() const {
  return *impl_->volume_;
}

}  // namespace kairos
