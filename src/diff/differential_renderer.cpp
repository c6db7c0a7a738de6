#include "diff/differential_renderer.h"

#include "core/stopwatch.h"

namespace kairos {

DifferentialRenderer::DifferentialRenderer(const Lattice& lattice, const RenderSettings& settings,
                                           const RendererOptions& options)
    : FrameRenderer(lattice, settings, options),
      exact_(scene_, options, {.segments = options.method == Method::segments}, image_,
             settings.depth ? &depth_ : nullptr) {}

void DifferentialRenderer::renderWhole() {
  exact_.restart();
  castTiles(exact_.staleTiles());
}

void DifferentialRenderer::renderChanges(const ChangedVoxels&, const AppliedChanges& applied) {
  Stopwatch clock;
  exact_.note(applied);
  if (exact_.changesNearlyAll(applied)) {
    statistics_.segmentsDirty = exact_.caster().index()->segmentCount();
    statistics_.selectMs = clock.lap();
    exact_.castAll(statistics_);
    return complete();
  }
  statistics_.segmentsDirty = exact_.mark();
  const std::vector<uint32_t>& tiles = exact_.staleTiles();
  statistics_.selectMs = clock.lap();
  castTiles(tiles);
}

void DifferentialRenderer::castTiles(const std::vector<uint32_t>& tiles) {
  exact_.cast(tiles, statistics_);
  complete();
}

void DifferentialRenderer::complete() {
  statistics_.cacheBytes = exact_.cacheBytes();
  statistics_.error = ErrorEstimate{};
}

uint64_t DifferentialRenderer::memoryBytes() const {
  return scene_.volume().memoryBytes() + exact_.memoryBytes();
}

}  // namespace kairos
