#include "diff/dvrm_renderer.h"

#include <algorithm>

#include "core/stopwatch.h"
#include "diff/second_order_difference.h"

namespace kairos {

DvrmRenderer::DvrmRenderer(const Lattice& lattice, const RenderSettings& settings,
                           const RendererOptions& options)
    : FrameRenderer(lattice, settings, options),
      influence_(VoxelProjection(settings, lattice, options.projection), pool_),
      recast_(scene_, options, image_, settings.depth ? &depth_ : nullptr) {}

void DvrmRenderer::renderWhole() {
  influence_.clear();
  before_.clear();
  castTiles(recast_.allTiles(), {}, 0);  // building the volume tells nothing of updating it
  statistics_.error = ErrorEstimate{};
}

void DvrmRenderer::renderChanges(const ChangedVoxels& changes, const AppliedChanges&) {
  Stopwatch clock;
  projectChanges(changes);
  influence_.refresh();
  const std::span<const int32_t> numbers = influence_.numbers();
  const std::vector<uint32_t>& tiles = recast_.tilesOf(numbers);
  statistics_.pixelsInfluenced =
      uint64_t(std::count_if(numbers.begin(), numbers.end(), [](int32_t n) { return n > 0; }));
  statistics_.selectMs = clock.lap();
  const bool exact = options_.projection.mode == ProjectionMode::conservative;
  castTiles(tiles, exact ? std::span<const int32_t>() : numbers, statistics_.updateMs);
  if (exact) statistics_.error = ErrorEstimate{};
}

void DvrmRenderer::projectChanges(const ChangedVoxels& changes) {
  if (options_.method == Method::dvrm) {
    influence_.clear();
    influence_.add(changes.leaves);
    return;
  }
  const SecondOrderDifference difference = secondOrderDifference(before_, changes.leaves);
  influence_.remove(difference.removed);
  influence_.add(difference.added);
  before_ = changes.leaves;
  statistics_.voxelsSampled = difference.count();
}

void DvrmRenderer::castTiles(const std::vector<uint32_t>& tiles, std::span<const int32_t> only,
                             double updateMs) {
  for (const uint32_t tile : tiles) statistics_.rayPoints += recast_.rayPoints(tile);
  const StepWork work{0, uint64_t(scene_.lattice().domain.voxelCount()), statistics_.voxelsSampled,
                      statistics_.rayPoints};
  if (model_.constants().rayPoint > 0) statistics_.predictedMs = model_.predict(work);
  recast_.cast(tiles, only, statistics_);
  model_.observe(work, {0, updateMs, statistics_.selectMs, statistics_.castMs});
}

Image DvrmRenderer::aov(Aov kind) const {
  if (kind == Aov::influence) return imageOf(influence_.numbers(), image_.width, image_.height);
  if (kind == Aov::samples) return recast_.rayPointsOfPixels();
  return FrameRenderer::aov(kind);
}

uint64_t DvrmRenderer::memoryBytes() const {
  return scene_.volume().memoryBytes() + recast_.memoryBytes() + influence_.memoryBytes();
}

}  // namespace kairos
