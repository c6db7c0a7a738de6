#include "tcdvrm/pixel_selection.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace kairos {
namespace {

int unitsAlong(int pixels, int shift) {
  return (pixels + (1 << shift) - 1) >> shift;
}

}  // namespace

PixelSelection::PixelSelection(const VoxelProjection& projection, int unitEdge)
    : projection_(projection),
      shift_(std::countr_zero(unsigned(unitEdge))),
      unitsX_(unitsAlong(projection.width(), shift_)),
      unitsY_(unitsAlong(projection.height(), shift_)),
      rows_(projection.height()),
      counts_(size_t(projection.width()) * size_t(projection.height())),
      determined_(size_t(unitsX_) * size_t(unitsY_)) {}

// Calls visit(first, last + 1) with the places in `counts_` of each row of a unit.
template <class Visit>
void PixelSelection::forEachPixelRow(uint32_t unit, Visit&& visit) const {
  const int x = int(unit % uint32_t(unitsX_)) << shift_, y = int(unit / uint32_t(unitsX_)) << shift_;
  const int width = projection_.width(), right = std::min(x + (1 << shift_), width);
  for (int row = y; row < std::min(y + (1 << shift_), projection_.height()); ++row)
    visit(size_t(row) * size_t(width) + size_t(x), size_t(row) * size_t(width) + size_t(right));
}

void PixelSelection::clearUnit(uint32_t unit) {
  forEachPixelRow(unit, [&](size_t begin, size_t end) { std::fill(&counts_[begin], &counts_[0] + end, 0); });
  determined_[unit] = 0;
}

void PixelSelection::clear() {
  for (const uint32_t unit : units_) clearUnit(unit);
  units_.clear();
  rayPoints_ = 0;
}

void PixelSelection::forget(std::span<const uint32_t> units) {
  for (const uint32_t unit : units) clearUnit(unit);
}

bool PixelSelection::covers(const Vec3i& voxel, bool wholeUnits) {
  projection_.project(voxel, rows_);
  for (int y = rows_.top; y <= rows_.bottom; ++y) {
    const size_t row = size_t(y) * size_t(projection_.width());
    const size_t units = size_t(y >> shift_) * size_t(unitsX_);
    for (int x = rows_.first[size_t(y)]; x <= rows_.last[size_t(y)]; ++x)
      if (wholeUnits ? !determined_[units + size_t(x >> shift_)] : counts_[row + size_t(x)] == 0)
        return false;
  }
  return true;
}

int32_t PixelSelection::largestCount(uint32_t unit) const {
  int32_t largest = 0;
  forEachPixelRow(unit, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) largest = std::max(largest, counts_[i]);
  });
  return largest;
}

const std::vector<uint32_t>& PixelSelection::unitsByInfluence() {
  largest_.resize(units_.size());
  int32_t most = 0;
  for (size_t i = 0; i < units_.size(); ++i) most = std::max(most, largest_[i] = largestCount(units_[i]));
  // A counting sort, the largest first.
  places_.assign(size_t(most) + 2, 0);
  for (const int32_t n : largest_) ++places_[size_t(most - n) + 1];
  std::partial_sum(places_.begin(), places_.end(), places_.begin());
  sorted_.resize(units_.size());
  for (size_t i = 0; i < units_.size(); ++i) sorted_[places_[size_t(most - largest_[i])]++] = units_[i];
  return sorted_;
}

}  // namespace kairos
