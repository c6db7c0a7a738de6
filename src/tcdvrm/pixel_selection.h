// Which pixels the voxels sampled so far have determined, and what casting them takes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "diff/voxel_projection.h"

namespace kairos {

/// D(r, s) and TS of Liao, Lai and Chung 2004, lines 8 to 14 of the algorithm: D(r, s) is the number of
/// sampled voxels that influence pixel (r, s), and the first of them adds the sampling points S(r, s) of its
/// ray to TS. Rays are cast in square units of pixels (1: single rays, 4: packets of 4x4); the first pixel
/// determined in a unit adds the points of all its rays, since all are cast.
class PixelSelection {
 public:
  /// Throws nothing; `unitEdge` is 1, 2 or 4.
  PixelSelection(const VoxelProjection& projection, int unitEdge);

  /// Forgets all samples; takes time for what they touched only.
  void clear();

  /// Takes in one sampled voxel. `rayPoints(unit)` says how many sampling points a unit's rays have; it is
  /// asked once for each unit that is determined.
  template <class RayPoints>
  void add(const Vec3i& voxel, RayPoints&& rayPoints) {
    projection_.project(voxel, rows_);
    for (int y = rows_.top; y <= rows_.bottom; ++y) {
      const int first = rows_.first[size_t(y)], last = rows_.last[size_t(y)];
      if (last < first) continue;
      countRow(y, first, last);
      const uint32_t row = uint32_t(y >> shift_) * uint32_t(unitsX_);
      for (uint32_t unit = row + uint32_t(first >> shift_); unit <= row + uint32_t(last >> shift_); ++unit) {
        if (determined_[unit]) continue;
        determined_[unit] = 1;
        units_.push_back(unit);
        rayPoints_ += rayPoints(unit);
      }
    }
  }

  /// Units that were not cast after all; TS keeps them.
  void forget(std::span<const uint32_t> units);

  /// Does every pixel of the voxel's J count, or (`wholeUnits`) lie in a unit with one that does?
  bool covers(const Vec3i& voxel, bool wholeUnits);

  /// TS.
  uint64_t rayPoints() const { return rayPoints_; }
  /// D of every pixel, row by row, top row first.
  std::span<const int32_t> counts() const { return counts_; }
  int unitsX() const { return unitsX_; }
  /// Units with a determined pixel, in the order in which they were determined.
  const std::vector<uint32_t>& units() const { return units_; }
  /// The same, those with the largest D of any pixel first, the earlier determined first among equals.
  const std::vector<uint32_t>& unitsByInfluence();

 private:
  void countRow(int y, int first, int last) {
    int32_t* row = counts_.data() + size_t(y) * size_t(projection_.width());
    for (int x = first; x <= last; ++x) ++row[x];
  }
  int32_t largestCount(uint32_t unit) const;
  void clearUnit(uint32_t unit);
  template <class Visit>
  void forEachPixelRow(uint32_t unit, Visit&& visit) const;

  VoxelProjection projection_;
  int shift_, unitsX_, unitsY_;
  PixelRows rows_;
  std::vector<int32_t> counts_;
  std::vector<uint8_t> determined_;  // per unit
  std::vector<uint32_t> units_, sorted_;
  std::vector<int32_t> largest_;
  std::vector<uint32_t> places_;  // scratch of `unitsByInfluence`
  uint64_t rayPoints_ = 0;
};

}  // namespace kairos
