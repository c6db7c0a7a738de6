// The changes between two scenes, voxel by voxel.
#pragma once

#include "support/changes.h"
#include "support/scenes.h"

namespace kairos::test {

/// Every voxel of the domain whose value differs, with its value in `after`.
inline ChangedVoxels differences(const Scene& before, const Scene& after) {
  VoxelMap changed;
  const VoxelBox& box = before.lattice.domain;
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      for (int x = box.lo.x; x < box.hi.x; ++x) {
        const double value = after.field.value({x, y, z});
        if (value != before.field.value({x, y, z})) changed[{x, y, z}] = value;
      }
  return changesOf(before.lattice.type, changed);
}

}  // namespace kairos::test
