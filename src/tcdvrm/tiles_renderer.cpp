#include "tcdvrm/tiles_renderer.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/stopwatch.h"
#include "tcdvrm/block_queue.h"
#include "tcdvrm/interpolatable.h"

namespace kairos {
namespace {

constexpr double kErrorShare = 0.07;   // of the budget, for the rays that measure the error
constexpr double kExactShare = 0.92;   // of the budget that an exact frame may be expected to take
constexpr float kHidden = 0.002f;      // transmittance behind which nothing is followed
constexpr size_t kFewestTiles = 16;    // of a batch, where they fit
constexpr double kLeastError = 1e-12;  // squared, of a stale tile's pixel
constexpr uint32_t kNever = ~0u;

}  // namespace

TilesRenderer::TilesRenderer(const Lattice& lattice, const RenderSettings& settings,
                             const RendererOptions& options)
    : FrameRenderer(lattice, interpolatable(settings), options),
      meter_(options.budget, options.clock),
      exact_(scene_, options, {}, image_, nullptr),
      levels_(scene_),
      probe_(scene_, levels_, options.seed) {
  withSegmentLists(exact_.caster());
}

size_t TilesRenderer::unitOf(uint32_t tile) const {
  const auto tilesX = uint32_t(exact_.caster().view().tilesX());
  constexpr uint32_t kUnitTiles = kUnitEdge / kTileEdge;
  return size_t(tile / tilesX / kUnitTiles) * size_t(probe_.unitsX()) + tile % tilesX / kUnitTiles;
}

void TilesRenderer::renderWhole() {
  unitError_.assign(size_t(probe_.unitCount()), 0);
  exact_.restart();
  levels_.restart();
  probe_.restart();
  uint64_t latticeSamples = 0;
  for (int tile = 0; tile < exact_.tileCount(); ++tile)
    for (const Segment& s : exact_.caster().index()->segments(tile))
      if (scene_.occupancy().visible(s.cell)) latticeSamples += uint64_t(s.kEnd - s.kBegin) * kLanes;
  meter_.beginCasting();
  exact_.cast(exact_.staleTiles(), statistics_);
  meter_.endCasting({double(statistics_.samples), double(statistics_.segmentsRecast)});
  if (latticeSamples > 0 && statistics_.samples > 0) {
    samplesPerLatticeSample_ = double(statistics_.samples) / double(latticeSamples);
    segmentsPerSample_ = double(statistics_.segmentsRecast) / double(statistics_.samples);
  }
  cells_.assign(scene_.volume().cellCount(), {});
  changedIn_.assign(cells_.size(), kNever);
  for (uint32_t cell = 0; cell < cells_.size(); ++cell) look(cell, cells_[cell]);
  estimates_.assign(size_t(exact_.tileCount()), {});
  lastCast_.assign(size_t(exact_.tileCount()), frame_);
  statistics_.error = ErrorEstimate{};
}

// Classifies eight voxels of each of a brick's sub-blocks, and what changed since they were last seen.
void TilesRenderer::look(uint32_t cell, Cell& seen) const {
  const bool first = seen.drawn.empty();
  if (first) seen.drawn.assign(kSubBlocks * kDraws * 4, 0.0f);
  dispatch(scene_.lattice().type, [&]<class T>() {
    const T* brick = scene_.volume().brick<T>(cell);
    for (size_t b = 0; b < kSubBlocks; ++b) {
      Float4 mean = {0, 0, 0, 0}, change = {0, 0, 0, 0};
      float square = 0;
      for (size_t d = 0; d < kDraws; ++d) {
        const size_t x = (b & 3) * kSubBlockEdge + 1 + (d & 1) * 2,
                     y = (b >> 2 & 3) * kSubBlockEdge + 1 + (d >> 1 & 1) * 2,
                     z = (b >> 4) * kSubBlockEdge + 1 + (d >> 2) * 2;
        const auto colour = scene_.table().classify(float(brick[x + kBrickStride * (y + kBrickStride * z)]));
        const Float4 now = load4(colour.data());
        float* before = seen.drawn.data() + (b * kDraws + d) * 4;
        const Float4 difference = first ? Float4{0, 0, 0, 0} : now - load4(before);
        store4(before, now);
        mean += now;
        change += difference;
        square += sum4(difference * difference);
      }
      seen.mean[b] = mean / float(kDraws);
      seen.change[b] = change / float(kDraws);
      seen.square[b] = square / float(kDraws);
    }
  });
}

// Follows this step's changes along the middle of a tile, front to back.
void TilesRenderer::estimate(uint32_t tile) {
  const SegmentIndex& index = *exact_.caster().index();
  Float4 front = {0, 0, 0, 0}, sum = {0, 0, 0, 0}, opacityByFront = {0, 0, 0, 0};
  float transmittance = 1, opacity = 0, variance = 0;
  for (size_t s = index.begin(int(tile)); s < index.begin(int(tile) + 1) && transmittance > kHidden; ++s) {
    const Segment& segment = index.segment(s);
    const Cell& cell = cells_[segment.cell];
    const bool changed = changedIn_[segment.cell] == frame_;
    if (!changed && !scene_.occupancy().visible(segment.cell)) continue;
    Float4 mean = {0, 0, 0, 0}, change = {0, 0, 0, 0};
    float square = 0;
    const uint64_t read = index.subBlocks(s);
    for (uint64_t bits = read; bits != 0; bits &= bits - 1) {
      const auto b = size_t(std::countr_zero(bits));
      mean += cell.mean[b];
      if (!changed) continue;
      change += cell.change[b];
      square += cell.square[b];
    }
    const auto samples = float(segment.kEnd - segment.kBegin), share = 1 / float(std::popcount(read));
    mean *= share;
    if (changed) {
      change *= share * samples;
      sum += transmittance * change;
      opacity += change[3];
      opacityByFront += change[3] * front;
      variance += 2 * samples * transmittance * transmittance * square * share;
    }
    const float through = std::pow(std::max(1 - mean[3], 0.0f), samples);
    if (mean[3] > 0) front += transmittance * (1 - through) / mean[3] * mean;
    transmittance *= through;
  }
  estimates_[tile].change += sum - (opacity * front - opacityByFront);
  estimates_[tile].variance += variance;
}

CastWork TilesRenderer::workOf(uint32_t tile) const {
  const double samples = double(exact_.latticeSamples(tile)) * samplesPerLatticeSample_;
  return {samples, samples * segmentsPerSample_};
}

void TilesRenderer::renderChanges(const ChangedVoxels&, const AppliedChanges& applied) {
  Stopwatch clock;
  ++frame_;
  exact_.note(applied);
  statistics_.segmentsDirty = exact_.mark();
  pool_.forEach(applied.cells.size(), 8, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t cell = applied.cells[i];
      if (!applied.visibleBefore[i] && !scene_.occupancy().visible(cell)) continue;
      look(cell, cells_[cell]);
      changedIn_[cell] = frame_;
    }
  });
  CastWork all;
  const std::vector<uint32_t> stale = exact_.staleTiles();
  for (const uint32_t tile : stale) all += workOf(tile);
  if (meter_.cost(all) <= kExactShare * meter_.remaining()) {
    statistics_.selectMs = clock.lap();
    exact_.cast(stale, statistics_);
    for (const uint32_t tile : stale) lastCast_[tile] = frame_;
    for (const uint32_t tile : stale) estimates_[tile] = {};
    statistics_.error = ErrorEstimate{};
    return;
  }
  pool_.forEach(stale.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      if (exact_.touched(stale[i])) estimate(stale[i]);
  });
  std::vector<uint32_t> units;
  std::fill(unitError_.begin(), unitError_.end(), 0.0);
  for (const uint32_t tile : stale) unitError_[unitOf(tile)] = 1;
  for (uint32_t unit = 0; unit < unitError_.size(); ++unit)
    if (unitError_[unit] > 0) units.push_back(unit);
  const double packets = double(exact_.tileCount());
  const CastWork probed = probe_.cast(units, all * (1 / packets), kErrorShare * meter_.remaining(), meter_);
  const std::vector<uint32_t> tiles = inOrderOfWorth();
  statistics_.selectMs = clock.lap();
  castExactly(tiles);
  statistics_.samples += uint64_t(probed.samples);
  statistics_.raysCast += probe_.raysCast();
  measureError();
}

std::vector<uint32_t> TilesRenderer::inOrderOfWorth() {
  BlockQueue<uint32_t> queue;
  for (const uint32_t tile : exact_.staleTiles()) {
    const double cost = std::max(meter_.cost(workOf(tile)), 1e-9);
    queue.push(float(std::min(double(estimates_[tile].squared()) / cost, 1e30)), tile);
  }
  std::vector<uint32_t> tiles;
  while (!queue.empty()) tiles.push_back(queue.pop());
  return tiles;
}

void TilesRenderer::castExactly(std::span<const uint32_t> tiles) {
  for (size_t done = 0; done < tiles.size();) {
    const double left = meter_.safely(meter_.remaining());
    size_t end = done;
    for (double cost = 0; end < tiles.size(); ++end) {
      cost += meter_.cost(workOf(tiles[end]));
      if (cost > (end < done + kFewestTiles ? left : left / 2)) break;
    }
    if (end == done) return;
    const auto batch = tiles.subspan(done, end - done);
    const FrameStatistics before = statistics_;
    meter_.beginCasting();
    exact_.cast(batch, statistics_);
    meter_.endCasting({double(statistics_.samples - before.samples),
                       double(statistics_.segmentsRecast - before.segmentsRecast)});
    for (const uint32_t tile : batch) {
      estimates_[tile] = {};
      lastCast_[tile] = frame_;
    }
    done = end;
  }
}

void TilesRenderer::measureError() {
  const int tilesX = exact_.caster().view().tilesX();
  const auto stale = [&](int x, int y) {
    return exact_.stale(uint32_t(y / kTileEdge * tilesX + x / kTileEdge));
  };
  std::fill(unitError_.begin(), unitError_.end(), 0.0);
  double total = 0;
  for (const uint32_t tile : exact_.staleTiles()) {
    const double error = kLanes * (double(estimates_[tile].squared()) + kLeastError);
    unitError_[unitOf(tile)] += error;
    total += error;
    statistics_.stalePixels += uint64_t(exact_.caster().view().raysOf(int(tile)));
  }
  statistics_.error = probe_.measure(
      image_, [&](uint32_t unit) { return unitError_[unit]; }, total, stale);
}

Image TilesRenderer::aov(Aov kind) const {
  Image values = FrameRenderer::aov(kind);
  const int tilesX = exact_.caster().view().tilesX();
  for (int y = 0; y < values.height; ++y)
    for (int x = 0; x < values.width; ++x) {
      const auto tile = uint32_t(y / kTileEdge * tilesX + x / kTileEdge);
      if (!exact_.stale(tile)) continue;
      if (kind == Aov::age) *values.pixel(x, y) = float(frame_ - lastCast_[tile]);
      if (kind == Aov::error) *values.pixel(x, y) = std::sqrt(estimates_[tile].squared() / 4);
    }
  return values;
}

uint64_t TilesRenderer::memoryBytes() const {
  return scene_.volume().memoryBytes() + exact_.memoryBytes() +
         cells_.size() * (sizeof(Cell) + kSubBlocks * kDraws * sizeof(Float4));
}

}  // namespace kairos
