#include "raycast/occupancy.h"

#include <bit>
#include <limits>

#include "raycast/slab_levels.h"

namespace kairos {

Occupancy::Occupancy(const RenderSettings& settings, const ClassificationTable& table)
    : table_(table), mode_(settings.mode), slabs_(settings.slabs()), skip_(settings.skipInvisible) {}

bool Occupancy::judgeRange(ValueRange range) const {
  if (mode_ == RenderMode::dvr) return table_.visible(range.lo, range.hi);
  return range.lo != range.hi || range.lo != background_;
}

// How far a slab's end can lie beyond the values around it, as a share of their range (kCurvature).
constexpr float kOvershoot = 2 * kCurvature;

bool Occupancy::judgeBrick(ValueRange range) const {
  if (!slabs_) return judgeRange(range);
  const float margin = (range.hi - range.lo) * kOvershoot;
  return judgeRange({range.lo - margin, range.hi + margin});
}

// A slab between two invisible windows passes all values between theirs, so these must lie on one side of
// what is visible, the same for all windows.
bool Occupancy::judgeWindow(ValueRange window, ValueRange brick) const {
  if (!slabs_) return judgeRange(window);
  constexpr float kNever = -std::numeric_limits<float>::infinity();
  if (table_.firstVisible() > kNever)
    return !(window.hi + (window.hi - brick.lo) * kOvershoot < table_.firstVisible());
  return !(window.lo - (brick.hi - window.lo) * kOvershoot > table_.lastVisible());
}

// The brick's visible windows; none of an invisible brick. Only those in `dirty` are judged anew.
uint64_t Occupancy::judge(const BrickVolume& volume, uint32_t cell, uint64_t dirty) const {
  if (!skip_) return ~uint64_t(0);
  if (!judgeBrick(volume.range(cell))) return 0;
  if (mode_ == RenderMode::mip) return ~uint64_t(0);  // a window of background still counts as background
  if (slabs_) dirty = ~uint64_t(0);                   // windows are judged by the brick's range too
  uint64_t mask = windows_[cell] & ~dirty;
  const std::array<ValueRange, kWindows> ranges = volume.windowRanges(cell);
  for (uint64_t rest = dirty; rest != 0; rest &= rest - 1) {
    const auto w = size_t(std::countr_zero(rest));
    mask |= uint64_t(judgeWindow(ranges[w], volume.range(cell))) << w;
  }
  return mask;
}

void Occupancy::build(const BrickVolume& volume) {
  background_ = float(volume.background());
  visible_.resize(volume.cellCount());
  windows_.resize(volume.cellCount());
  visibleCount_ = 0;
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
    windows_[cell] = judge(volume, cell, ~uint64_t(0));
    visible_[cell] = windows_[cell] != 0;
    visibleCount_ += visible_[cell];
  }
}

void Occupancy::update(const BrickVolume& volume, const DirtyBricks& dirty, std::vector<uint8_t>& before) {
  before.resize(dirty.cells.size());
  for (size_t i = 0; i < dirty.cells.size(); ++i) {
    const uint32_t cell = dirty.cells[i];
    uint8_t& flag = visible_[cell];
    before[i] = flag;
    windows_[cell] = judge(volume, cell, dirty.windows[i]);
    flag = windows_[cell] != 0;
    visibleCount_ += flag - before[i];
  }
}

}  // namespace kairos
