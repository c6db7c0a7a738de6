#include "tcdvrm/tcdvrm_renderer.h"

#include <algorithm>

#include "diff/influence_map.h"
#include "tcdvrm/change_magnitude.h"
#include "tcdvrm/voxel_pool.h"

namespace kairos {
namespace {

// How often a cut-off looks at the clock.
constexpr size_t kTilesPerBatch = 256;

ChangedVoxels nothingWaiting() {
  ChangedVoxels none;
  none.values = std::vector<float>();
  return none;
}

}  // namespace

TcdvrmRenderer::TcdvrmRenderer(const Lattice& lattice, const RenderSettings& settings,
                               const RendererOptions& options)
    : FrameRenderer(lattice, settings, options),
      clock_(options.clock ? *options.clock : steadyBudgetClock()),
      projection_(settings, lattice, options.projection),
      selection_(projection_, kTileEdge),
      recast_(scene_, options, image_, settings.depth ? &depth_ : nullptr),
      model_(options.tcdvrm.calibrate),
      waiting_(nothingWaiting()) {}

void TcdvrmRenderer::beginFrame() {
  begin_ = clock_.now();
}

void TcdvrmRenderer::beforeUpdate(const ChangedVoxels& changes) {
  if (options_.tcdvrm.lom == LevelOfModification::magnitude)
    magnitudes_ = changeMagnitudes(scene_.volume(), changes, pool_);
}

// Step 0: everything, and a first measure of C_c.
void TcdvrmRenderer::renderWhole() {
  frame_ = 0;
  exact_ = true;
  selection_.clear();
  waiting_ = nothingWaiting();
  for (const uint32_t tile : recast_.allTiles()) statistics_.rayPoints += recast_.rayPoints(tile);
  cast(recast_.allTiles());
  learn(0, statistics_.rayPoints);
  statistics_.error = ErrorEstimate{};
}

void TcdvrmRenderer::renderChanges(const ChangedVoxels& changes, const AppliedChanges&) {
  ++frame_;
  recast_.beginStep();
  const double updateMs = elapsed();
  const bool allSampled = select(candidates(changes));
  statistics_.selectMs = elapsed() - updateMs;
  statistics_.predictedMs = model_.predictWhenCast(elapsed(), selection_.rayPoints());
  const bool allCast = castSelected();
  learn(updateMs, allCast ? selection_.rayPoints() : rayPointsCast());
  if (options_.tcdvrm.carryOver) keepWaiting();
  exact_ = options_.tcdvrm.carryOver ? waiting_.empty() : exact_ && allSampled && allCast;
  if (!exact_)
    statistics_.stalePixels = uint64_t(image_.width) * uint64_t(image_.height) - statistics_.pixelsRecast;
  if (exact_ && options_.projection.mode == ProjectionMode::conservative) statistics_.error = ErrorEstimate{};
}

// What may be sampled in this step: its changed voxels, and with carry-over those that earlier steps left.
const ChangedVoxels& TcdvrmRenderer::candidates(const ChangedVoxels& changes) {
  if (!options_.tcdvrm.carryOver) return changes;
  magnitudes_.resize(changes.count());
  waiting_ = unitedVoxels(waiting_, changes.leaves, magnitudes_);
  return waiting_;
}

// Returns whether all candidates were sampled.
bool TcdvrmRenderer::select(const ChangedVoxels& candidates) {
  selection_.clear();
  const uint64_t seed = options_.seed * 0x9e3779b97f4a7c15ull + frame_;
  bool all;
  if (options_.tcdvrm.lom == LevelOfModification::influence) {
    uniform_.restart(candidates.count(), seed);
    all = drawUntilBudgetIsUsed(candidates, uniform_);
  } else {
    const auto& magnitudes = options_.tcdvrm.carryOver ? valuesAs<float>(waiting_.values) : magnitudes_;
    weighted_.restart(samplingWeights(magnitudes), seed);
    all = drawUntilBudgetIsUsed(candidates, weighted_);
  }
  const auto counts = selection_.counts();
  statistics_.pixelsInfluenced =
      uint64_t(std::count_if(counts.begin(), counts.end(), [](int32_t d) { return d > 0; }));
  statistics_.rayPoints = selection_.rayPoints();
  return all;
}

// Lines 9 to 17 of the algorithm. Returns whether all candidates were sampled.
template <class Sampler>
bool TcdvrmRenderer::drawUntilBudgetIsUsed(const ChangedVoxels& candidates, Sampler& sampler) {
  statistics_.voxelsSampled = 0;
  for (bool used = false; sampler.remaining() && !used; used = budgetIsUsed()) {
    selection_.add(candidates.locate(sampler.next()), [&](uint32_t tile) { return recast_.rayPoints(tile); });
    ++statistics_.voxelsSampled;
  }
  return sampler.remaining() == 0;
}

bool TcdvrmRenderer::budgetIsUsed() const {
  const Budget& budget = options_.budget;
  if (budget.samples > 0 && selection_.rayPoints() >= budget.samples) return true;
  return budget.milliseconds > 0 &&
         model_.predictWhenCast(elapsed(), selection_.rayPoints()) >= budget.milliseconds;
}

// Carry-over: candidates wait until every pixel they influence has been cast.
void TcdvrmRenderer::keepWaiting() {
  selection_.forget(uncast_);
  const bool wholeTiles = options_.projection.mode == ProjectionMode::conservative;
  waiting_ = keptVoxels(waiting_, [&](const Vec3i& v) { return !selection_.covers(v, wholeTiles); });
}

// Line 18. Returns whether all selected rays were cast.
bool TcdvrmRenderer::castSelected() {
  const std::span<const uint32_t> tiles = selection_.unitsByInfluence();
  uncast_ = {};
  const double limit = options_.budget.milliseconds;
  const bool cutOff = options_.tcdvrm.cutOff && limit > 0;
  const size_t batch = cutOff ? kTilesPerBatch : std::max<size_t>(tiles.size(), 1);
  for (size_t begin = 0; begin < tiles.size(); begin += batch) {
    if (cutOff && begin > 0 && elapsed() >= limit) {
      uncast_ = tiles.subspan(begin);
      return false;
    }
    cast(tiles.subspan(begin, std::min(batch, tiles.size() - begin)));
  }
  return true;
}

void TcdvrmRenderer::cast(std::span<const uint32_t> tiles) {
  const double before = elapsed(), castMs = statistics_.castMs;
  const uint64_t samples = statistics_.samples, segments = statistics_.segmentsRecast;
  const bool all = options_.projection.mode == ProjectionMode::conservative || frame_ == 0;
  recast_.cast(tiles, all ? std::span<const int32_t>() : selection_.counts(), statistics_);
  clock_.worked(statistics_.samples - samples, statistics_.segmentsRecast - segments);
  statistics_.castMs = castMs + (elapsed() - before);
}

// TS of the rays that were cast before the time was over.
uint64_t TcdvrmRenderer::rayPointsCast() {
  uint64_t points = 0;
  const std::span<const uint32_t> tiles = selection_.unitsByInfluence();
  for (const uint32_t tile : tiles.first(tiles.size() - uncast_.size())) points += recast_.rayPoints(tile);
  return points;
}

// Line 19: what the step teaches about the next one.
void TcdvrmRenderer::learn(double updateMs, uint64_t rayPoints) {
  const StepWork work{0, uint64_t(scene_.lattice().domain.voxelCount()), statistics_.voxelsSampled,
                      rayPoints};
  model_.observe(work, {0, updateMs, statistics_.selectMs, statistics_.castMs});
}

Image TcdvrmRenderer::aov(Aov kind) const {
  if (kind == Aov::influence) return imageOf(selection_.counts(), image_.width, image_.height);
  if (kind == Aov::samples) return recast_.rayPointsOfPixels();
  if (kind == Aov::age && !statistics_.error) return recast_.stepsSinceWritten();
  return FrameRenderer::aov(kind);
}

uint64_t TcdvrmRenderer::memoryBytes() const {
  return scene_.volume().memoryBytes() + recast_.memoryBytes();
}

}  // namespace kairos
