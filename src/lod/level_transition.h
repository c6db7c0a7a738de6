// How the values of a subvolume pass over into those of coarser ones next to it.
#pragma once

#include <cstdint>
#include <vector>

#include "lod/scalar_pyramid.h"
#include "lod/subdivision.h"

namespace kairos {

/// The level each subvolume is rendered at; 0 where it is not rendered.
using SubvolumeLevels = std::vector<uint8_t>;

/// Where vertex `v`, counted in level 0, lies among the vertices of a level.
struct LatticePosition {
  Vec3i low;        // in vertices of the level
  double above[3];  // of one cell

  LatticePosition(const Vec3i& v, int level) {
    for (int a = 0; a < 3; ++a) {
      low[a] = v[a] >> level;
      above[a] = double(v[a] - (low[a] << level)) / (1 << level);
    }
  }

  /// Trilinear; `valueAt` is asked for the vertices that count, in vertices of the level.
  template <class ValueAt>
  double interpolate(const ValueAt& valueAt) const {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3i at{corner & 1, corner >> 1 & 1, corner >> 2};
      double weight = 1;
      for (int a = 0; a < 3; ++a) weight *= at[a] ? above[a] : 1 - above[a];
      if (weight > 0) sum += weight * double(valueAt(low + at));
    }
    return sum;
  }
};

/// At a coarser subvolume's faces values are as coarse as its own, and become finer with the distance: as if
/// they were of a level that falls in proportion to it, until it is that of the subvolume they are in.
/// Between two levels of the pyramid both are mixed, as LaMar et al. 2000 (section 4) mix two tiles by a
/// ratio that falls along a node.
///
/// Distances are the largest of the three axes', in voxels. A transition ends within the smallest subvolume's
/// edge: only subvolumes that touch the one a vertex is in can reach the vertex, and all those that share the
/// vertex agree on its value.
class LevelTransition {
 public:
  LevelTransition(const ScalarPyramid& pyramid, const Subdivision& subdivision, const SubvolumeLevels& levels)
      : pyramid_(pyramid), subdivision_(subdivision), levels_(levels) {}

  /// The value at a vertex, counted in level 0, that belongs to subvolume i.
  double value(const Vec3i& vertex, uint32_t i) const;

  /// The same for all vertices of subvolume i, which has coarser neighbours; its texels without transitions
  /// are given.
  void apply(uint32_t i, std::vector<float>& texels);

 private:
  struct Coarser {
    VoxelBox box;
    double level, slope;  // levels a voxel
  };

  struct Range {
    int begin, end;
  };

  Coarser coarser(uint32_t j) const;
  Range mixLevels(const Vec3i& first, int level, const std::vector<Coarser>& coarser);
  const std::vector<float>& interpolatedRow(const Vec3i& first, int level, int from, const Range& range);

  const ScalarPyramid& pyramid_;
  const Subdivision& subdivision_;
  const SubvolumeLevels& levels_;
  std::vector<double> mixed_;             // the levels of a row of vertices
  std::vector<std::vector<float>> rows_;  // the row's values as of each level; empty: not yet known
  std::vector<float> coarseRow_;
};

}  // namespace kairos
