#include "tcdvrm/voxel_pool.h"

#include <bit>

namespace kairos {
namespace {

// Builds a set voxel by voxel, in order.
class PoolBuilder {
 public:
  void beginLeaf(const Vec3i& origin) { leaf_ = {origin, {}, values_.size()}; }
  void add(int z, uint64_t bit, float magnitude) {
    leaf_.mask[size_t(z)] |= bit;
    values_.push_back(magnitude);
  }
  void endLeaf() {
    if (values_.size() > leaf_.first) set_.leaves.push_back(leaf_);
  }
  ChangedVoxels take() {
    set_.values = std::move(values_);
    return std::move(set_);
  }

 private:
  ChangedVoxels set_;
  ChangedLeaf leaf_;
  std::vector<float> values_;
};

// The leaf of two of the same place, either of which may be missing.
void addUnited(const ChangedLeaf* a, const float* aValues, const ChangedLeaf* b, const float* bValues,
               PoolBuilder& pool) {
  pool.beginLeaf(a ? a->origin : b->origin);
  for (int z = 0; z < kLeafEdge; ++z) {
    const uint64_t inA = a ? a->mask[size_t(z)] : 0, inB = b ? b->mask[size_t(z)] : 0;
    for (uint64_t word = inA | inB; word != 0; word &= word - 1) {
      const uint64_t bit = word & (0 - word);
      float magnitude = 0;
      if (inA & bit) magnitude += *aValues++;
      if (inB & bit) magnitude += *bValues++;
      pool.add(z, bit, magnitude);
    }
  }
  pool.endLeaf();
}

}  // namespace

ChangedVoxels unitedVoxels(const ChangedVoxels& waiting, const std::vector<ChangedLeaf>& changed,
                           std::span<const float> magnitudes) {
  PoolBuilder pool;
  const float* waitingValues = valuesAs<float>(waiting.values).data();
  auto w = waiting.leaves.begin();
  auto c = changed.begin();
  while (w != waiting.leaves.end() || c != changed.end()) {
    const bool first = w != waiting.leaves.end() && (c == changed.end() || !lessZYX(c->origin, w->origin));
    const bool second = c != changed.end() && (w == waiting.leaves.end() || !lessZYX(w->origin, c->origin));
    addUnited(first ? &*w : nullptr, first ? waitingValues + w->first : nullptr, second ? &*c : nullptr,
              second ? magnitudes.data() + c->first : nullptr, pool);
    w += first;
    c += second;
  }
  return pool.take();
}

ChangedVoxels keptVoxels(const ChangedVoxels& set, const std::function<bool(const Vec3i&)>& keep) {
  PoolBuilder pool;
  const float* magnitude = valuesAs<float>(set.values).data();
  for (const ChangedLeaf& leaf : set.leaves) {
    pool.beginLeaf(leaf.origin);
    for (int z = 0; z < kLeafEdge; ++z)
      for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1, ++magnitude) {
        const int offset = std::countr_zero(word);
        if (keep(leaf.origin + Vec3i{offset & 7, offset >> 3, z})) pool.add(z, word & (0 - word), *magnitude);
      }
    pool.endLeaf();
  }
  return pool.take();
}

}  // namespace kairos
