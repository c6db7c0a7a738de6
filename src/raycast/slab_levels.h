// How long the slabs of each brick are.
#pragma once

#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "raycast/render_settings.h"
#include "volume/brick_volume.h"

namespace kairos {

/// Per cell the binary logarithm of its slabs' length, in distances of the slabs' lattice
/// (RenderSettings::latticeStep). The same for all under `preintegrated`; under `error` a function of the
/// brick's own values, the transfer function and the view, so that who renders a step, and how, cannot
/// matter.
class SlabLevels {
 public:
  SlabLevels(const RenderSettings& settings, const ClassificationTable& table);

  void build(const BrickVolume& volume, ThreadPool& pool);
  /// Judges the bricks anew that an update of the volume touched. `changed[i]`: did the level of
  /// dirty.cells[i] change?
  void update(const BrickVolume& volume, const DirtyBricks& dirty, ThreadPool& pool,
              std::vector<uint8_t>& changed);

  const uint8_t* levels() const { return levels_.data(); }

 private:
  uint8_t judge(const BrickVolume& volume, uint32_t cell) const;

  const ClassificationTable& table_;
  const double error_, latticeStep_;
  const int fixedLevel_;
  std::vector<uint8_t> levels_;
};

/// Two ends closer together than so many nodes of the classification table are joined by a straight line of
/// densities, whatever lies between them: the difference of the integrals would be all rounding.
inline constexpr float kShortestReach = 1.0f / 64;

/// A slab's ends are not the values there but u = v - kCurvature * (v' - 2 v + v''), v' and v'' the values
/// one slab before and behind: a straight line between such ends has the mean of the field, to fourth order.
inline constexpr float kCurvature = 1.0f / 12;

/// A slab counts as whole, not cut by the volume's boundary, from this share of its length.
inline constexpr float kWholeSlab = 0.999f;

/// Slabs of a run of `length` lattice intervals.
constexpr int32_t slabCount(int32_t length, int level) {
  return (length + (1 << level) - 1) >> level;
}

}  // namespace kairos
