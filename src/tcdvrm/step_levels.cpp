#include "tcdvrm/step_levels.h"

#include <cmath>

namespace kairos {

StepLevels::StepLevels(const SceneState& scene) : scene_(scene) {
  for (int l = 0; l < kCount; ++l) {
    Level& level = levels_[size_t(l)];
    level.settings = scene.settings();
    level.settings.step *= double(1 << l);
    level.table = level.settings.classification(scene.lattice());
  }
}

void StepLevels::restart() {
  for (int l = 0; l < kCount; ++l) {
    Level& level = levels_[size_t(l)];
    level.scene = makeKernelScene(level.settings, scene_.volume(), level.table, scene_.occupancy(),
                                  scene_.slabLevels());
    // The exact frame's slab levels, on this level's lattice.
    level.scene.levelBias =
        l + int(std::lround(std::log2(scene_.settings().latticeStep() / level.settings.latticeStep())));
    level.kernel = level.settings.kernel == Kernel::general ? generalKernel(level.scene, level.settings.isa)
                                                            : fastestKernel(level.scene, level.settings.isa);
  }
}

}  // namespace kairos
