#include "diff/second_order_difference.h"

namespace kairos {
namespace {

uint64_t voxelCount(const std::vector<ChangedLeaf>& leaves) {
  return leaves.empty() ? 0 : leaves.back().first + uint64_t(leaves.back().count());
}

// Appends the voxels of `leaf` that `other`, a leaf of the same place or none, lacks.
void appendOnly(const ChangedLeaf& leaf, const ChangedLeaf* other, std::vector<ChangedLeaf>& list) {
  ChangedLeaf only{leaf.origin, leaf.mask, voxelCount(list)};
  uint64_t any = 0;
  for (size_t z = 0; z < only.mask.size(); ++z) {
    if (other) only.mask[z] &= ~other->mask[z];
    any |= only.mask[z];
  }
  if (any) list.push_back(only);
}

}  // namespace

uint64_t SecondOrderDifference::count() const {
  return voxelCount(added) + voxelCount(removed);
}

SecondOrderDifference secondOrderDifference(const std::vector<ChangedLeaf>& before,
                                            const std::vector<ChangedLeaf>& now) {
  SecondOrderDifference difference;
  auto b = before.begin();
  auto n = now.begin();
  while (b != before.end() || n != now.end()) {
    const bool inBefore = b != before.end() && (n == now.end() || !lessZYX(n->origin, b->origin));
    const bool inNow = n != now.end() && (b == before.end() || !lessZYX(b->origin, n->origin));
    if (inBefore) appendOnly(*b, inNow ? &*n : nullptr, difference.removed);
    if (inNow) appendOnly(*n, inBefore ? &*b : nullptr, difference.added);
    b += inBefore;
    n += inNow;
  }
  return difference;
}

}  // namespace kairos
