// The scene at longer sample distances.
#pragma once

#include <array>

#include "raycast/scene_state.h"

namespace kairos {

/// Settings, classification and kernel for sample distances of 1, 2 and 4 times the exact frame's (step
/// levels 0, 1 and 2).
class StepLevels {
 public:
  static constexpr int kCount = 3;
  struct Level {
    RenderSettings settings;
    ClassificationTable table;
    KernelScene scene{};
    TileKernel kernel = nullptr;
  };

  explicit StepLevels(const SceneState& scene);
  /// After SceneState::start.
  void restart();
  const Level& operator[](int level) const { return levels_[size_t(level)]; }

 private:
  const SceneState& scene_;
  std::array<Level, kCount> levels_;
};

}  // namespace kairos
