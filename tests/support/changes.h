// Building sets of changed voxels for tests.
#pragma once

#include <map>
#include <random>

#include "volume/changed_voxels.h"

namespace kairos::test {

struct LessZYX {
  bool operator()(const Vec3i& a, const Vec3i& b) const { return lessZYX(a, b); }
};
/// Voxels and values, the plainest model of a field or of a set of changes.
using VoxelMap = std::map<Vec3i, double, LessZYX>;

/// The set of changes that writes exactly these voxels.
ChangedVoxels changesOf(ElementType type, const VoxelMap& voxels);

/// `count` voxels drawn from `box`, with values from the whole range of the type; about one in eight becomes
/// `background`, so that leaves and bricks empty again.
VoxelMap randomVoxels(ElementType type, const VoxelBox& box, size_t count, double background,
                      std::mt19937& random);

}  // namespace kairos::test
