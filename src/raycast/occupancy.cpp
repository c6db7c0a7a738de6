#include "raycast/occupancy.h"

namespace kairos {

Occupancy::Occupancy(const RenderSettings& settings, const ClassificationTable& table)
    : table_(table), mode_(settings.mode), skip_(settings.skipInvisible) {}

bool Occupancy::judge(const BrickVolume& volume, uint32_t cell) const {
  if (!skip_) return true;
  const ValueRange range = volume.range(cell);
  if (mode_ == RenderMode::dvr) return table_.visible(range.lo, range.hi);
  return range.lo != range.hi || range.lo != float(volume.background());
}

void Occupancy::build(const BrickVolume& volume) {
  visible_.resize(volume.cellCount());
  visibleCount_ = 0;
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
    visible_[cell] = judge(volume, cell);
    visibleCount_ += visible_[cell];
  }
}

void Occupancy::update(const BrickVolume& volume, std::span<const uint32_t> cells, std::vector<uint8_t>& before) {
  before.resize(cells.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    uint8_t& flag = visible_[cells[i]];
    before[i] = flag;
    flag = judge(volume, cells[i]);
    visibleCount_ += flag - before[i];
  }
}

}  // namespace kairos
