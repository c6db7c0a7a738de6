#include "support/changes.h"

#include <cmath>

#include "support/scenes.h"

namespace kairos::test {

ChangedVoxels changesOf(ElementType type, const VoxelMap& voxels) {
  // Leaf by leaf, offsets ascending: the order in which the values stand.
  std::map<Vec3i, std::map<int, double>, LessZYX> leaves;
  for (const auto& [v, value] : voxels) {
    const Vec3i origin = leafOriginOf(v), local = v - origin;
    leaves[origin][leafOffset(local.x, local.y, local.z)] = value;
  }
  ChangedVoxels changes;
  dispatch(type, [&]<class T>() {
    std::vector<T> values;
    for (const auto& [origin, entries] : leaves) {
      ChangedLeaf leaf;
      leaf.origin = origin;
      leaf.first = values.size();
      for (const auto& [offset, value] : entries) {
        leaf.mask[size_t(offset / 64)] |= uint64_t(1) << (offset % 64);
        values.push_back(T(value));
      }
      changes.leaves.push_back(leaf);
    }
    changes.values = std::move(values);
  });
  return changes;
}

VoxelMap randomVoxels(ElementType type, const VoxelBox& box, size_t count, double background,
                      std::mt19937& random) {
  const Vec3i size = box.size();
  std::uniform_int_distribution<int> x(0, size.x - 1), y(0, size.y - 1), z(0, size.z - 1), oneIn(0, 7);
  std::uniform_real_distribution<double> unit(0, 1);
  VoxelMap voxels;
  for (size_t i = 0; i < count; ++i) {
    const double value = type == ElementType::f32 ? double(float(20 * unit(random) - 10))
                                                  : std::floor(unit(random) * (fullScale(type) + 1));
    const Vec3i v = box.lo + Vec3i{x(random), y(random), z(random)};
    voxels[v] = oneIn(random) == 0 ? background : value;
  }
  return voxels;
}

}  // namespace kairos::test
