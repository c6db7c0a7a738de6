#include "tcdvrm/step_levels.h"

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
  for (Level& level : levels_) {
    level.scene = makeKernelScene(level.settings, scene_.volume(), level.table, scene_.occupancy());
    level.kernel = level.settings.kernel == Kernel::general ? generalKernel(level.scene, level.settings.isa)
                                                            : fastestKernel(level.scene, level.settings.isa);
  }
}

}  // namespace kairos
