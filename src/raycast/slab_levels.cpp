#include "raycast/slab_levels.h"

#include <algorithm>
#include <cmath>

#include "raycast/slab_error.h"

namespace kairos {

SlabLevels::SlabLevels(const RenderSettings& settings, const ClassificationTable& table)
    : table_(table),
      error_(settings.error),
      latticeStep_(settings.latticeStep()),
      fixedLevel_(settings.slabs() ? settings.slabLevel() : 0) {}

// What a brick's own error may be of the image's. Errors of the bricks along a ray partly cancel, are dimmed
// by what lies in front, and pixels beside the volume have none; that this is enough was measured
// (docs/accuracy.md).
constexpr double kBrickShare = 0.5;

// The longest slabs, up to the brick's edge, that are expected to be right enough.
uint8_t SlabLevels::judge(const BrickVolume& volume, uint32_t cell) const {
  const int longest = std::max(0, int(std::floor(std::log2(kBrickEdge / latticeStep_))));
  const ValueRange range = volume.range(cell);
  if (range.lo == range.hi || !table_.visible(range.lo, range.hi)) return uint8_t(longest);
  const SlabErrors errors = SlabErrorMeter(table_, latticeStep_).measure(volume, cell);
  int level = longest;
  while (level > 0 && errors.at(std::ldexp(latticeStep_, level)) > kBrickShare * error_) --level;
  return uint8_t(level);
}

void SlabLevels::build(const BrickVolume& volume, ThreadPool& pool) {
  levels_.assign(volume.cellCount(), uint8_t(fixedLevel_));
  if (error_ == 0) return;
  pool.forEach(volume.cellCount(), 16, [&](size_t begin, size_t end) {
    for (size_t cell = begin; cell < end; ++cell) levels_[cell] = judge(volume, uint32_t(cell));
  });
}

void SlabLevels::update(const BrickVolume& volume, const DirtyBricks& dirty, ThreadPool& pool,
                        std::vector<uint8_t>& changed) {
  changed.assign(dirty.cells.size(), 0);
  if (error_ == 0) return;
  pool.forEach(dirty.cells.size(), 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      uint8_t& level = levels_[dirty.cells[i]];
      const uint8_t before = level;
      level = judge(volume, dirty.cells[i]);
      changed[i] = level != before;
    }
  });
}

}  // namespace kairos
