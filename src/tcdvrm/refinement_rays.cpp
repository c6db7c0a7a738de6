#include "tcdvrm/refinement_rays.h"

namespace kairos {

RefinementRays::RefinementRays(const SceneState& scene, const StepLevels& levels) : levels_(levels) {
  for (int level = 0; level < StepLevels::kCount; ++level) {
    const RenderSettings& settings = levels[level].settings;
    // All shifts of a stride have the same tiles; the last rays may stand beyond the image.
    const auto add = [&](int stride, int shiftX, int shiftY) {
      casters_[size_t(level)].emplace_back(
          settings, scene.volume(), scene.pool(),
          RayLattice{double(stride), 0.5 + shiftX, 0.5 + shiftY, (settings.width - 1) / stride + 1,
                     (settings.height - 1) / stride + 1});
    };
    for (const int stride : {16, 8, 4}) add(stride, 0, 0);
    for (int p = 0; p < 4; ++p) add(2, p & 1, p >> 1);
  }
}

void RefinementRays::cast(int stepLevel, Lattice lattice, int tile, PacketColours& colours,
                          PreparedTile& scratch, TileCounters& counters) const {
  castColours(casters_[size_t(stepLevel)][lattice], levels_[stepLevel].scene, levels_[stepLevel].kernel, tile,
              colours, scratch, counters);
}

uint64_t RefinementRays::memoryBytes() const {
  uint64_t bytes = 0;
  for (const auto& level : casters_)
    for (const TileCaster& caster : level) bytes += caster.index() ? caster.index()->memoryBytes() : 0;
  return bytes;
}

}  // namespace kairos
