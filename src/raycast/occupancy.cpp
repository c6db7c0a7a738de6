#include "raycast/occupancy.h"

namespace kairos {

Occupancy::Occupancy(const RenderSettings& settings, const ClassificationTable& table)
    : table_(table), mode_(settings.mode), skip_(settings.skipInvisible) {}

bool Occupancy::judgeRange(ValueRange range) const {
  if (mode_ == RenderMode::dvr) return table_.visible(range.lo, range.hi);
  return range.lo != range.hi || range.lo != background_;
}

// The brick's visible windows; none of an invisible brick.
uint64_t Occupancy::judge(const BrickVolume& volume, uint32_t cell) const {
  if (!skip_) return ~uint64_t(0);
  if (!judgeRange(volume.range(cell))) return 0;
  if (mode_ == RenderMode::mip) return ~uint64_t(0);  // a window of background still counts as background
  uint64_t mask = 0;
  const auto ranges = volume.windowRanges(cell);
  for (size_t w = 0; w < kWindows; ++w) mask |= uint64_t(judgeRange(ranges[w])) << w;
  return mask;
}

void Occupancy::build(const BrickVolume& volume) {
  background_ = float(volume.background());
  visible_.resize(volume.cellCount());
  windows_.resize(volume.cellCount());
  visibleCount_ = 0;
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
    windows_[cell] = judge(volume, cell);
    visible_[cell] = windows_[cell] != 0;
    visibleCount_ += visible_[cell];
  }
}

void Occupancy::update(const BrickVolume& volume, std::span<const uint32_t> cells,
                       std::vector<uint8_t>& before) {
  before.resize(cells.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    uint8_t& flag = visible_[cells[i]];
    before[i] = flag;
    windows_[cells[i]] = judge(volume, cells[i]);
    flag = windows_[cells[i]] != 0;
    visibleCount_ += flag - before[i];
  }
}

}  // namespace kairos
