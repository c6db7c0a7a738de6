#include "volume/changed_voxels.h"

#include <algorithm>
#include <cstring>

#include "core/error.h"

namespace kairos {
namespace {

// The position (0..511) of set bit number `n` of a leaf's mask.
int nthChangedOffset(const std::array<uint64_t, 8>& mask, uint64_t n) {
  for (int z = 0; z < 8; ++z) {
    uint64_t word = mask[size_t(z)];
    const auto inWord = uint64_t(std::popcount(word));
    if (n >= inWord) {
      n -= inWord;
      continue;
    }
    while (n-- > 0) word &= word - 1;
    return z * 64 + std::countr_zero(word);
  }
  return kLeafVoxels;
}

// FNV-1a over 64-bit words, with the high bits folded in: quick, order-dependent, no cryptographic claim.
class ContentHash {
 public:
  void add(uint64_t word) { hash_ = (hash_ ^ word) * 0x100000001b3ull ^ (hash_ >> 29); }
  void add(const void* data, size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (; bytes >= 8; p += 8, bytes -= 8) {
      uint64_t word;
      std::memcpy(&word, p, 8);
      add(word);
    }
    uint64_t tail = 0;
    if (bytes > 0) std::memcpy(&tail, p, bytes);
    add(tail ^ (uint64_t(bytes) << 56));
  }
  uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325ull;
};

}  // namespace

Vec3i ChangedVoxels::locate(uint64_t i) const {
  const auto after = std::upper_bound(leaves.begin(), leaves.end(), i,
                                      [](uint64_t n, const ChangedLeaf& l) { return n < l.first; });
  const ChangedLeaf& leaf = *std::prev(after);
  const int offset = nthChangedOffset(leaf.mask, i - leaf.first);
  return leaf.origin + Vec3i{offset & 7, (offset >> 3) & 7, offset >> 6};
}

VoxelBox ChangedVoxels::bounds() const {
  VoxelBox box;
  for (const ChangedLeaf& leaf : leaves)
    box = unite(box, {leaf.origin, leaf.origin + Vec3i{kLeafEdge, kLeafEdge, kLeafEdge}});
  return box;
}

uint64_t contentChecksum(const ChangedVoxels& changes) {
  ContentHash hash;
  hash.add(uint64_t(changes.type()));
  for (const ChangedLeaf& leaf : changes.leaves) {
    hash.add(uint64_t(uint32_t(leaf.origin.x)) | uint64_t(uint32_t(leaf.origin.y)) << 32);
    hash.add(uint64_t(uint32_t(leaf.origin.z)));
    for (uint64_t word : leaf.mask) hash.add(word);
  }
  std::visit([&](const auto& v) { hash.add(v.data(), v.size() * sizeof(v[0])); }, changes.values);
  return hash.value();
}

namespace {

template <class T>
void writeLeaf(const ChangedLeaf& leaf, const T* newValues, T* voxels) {
  for (int z = 0; z < 8; ++z)
    for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1)
      voxels[z * 64 + std::countr_zero(word)] = *newValues++;
}

// Makes room for the leaves of `changes` that `field` lacks, keeping the order: from the back, so in place.
template <class T>
void addMissingLeaves(const ChangedVoxels& changes, Field& field) {
  size_t missing = 0;
  for (const ChangedLeaf& leaf : changes.leaves) missing += field.findLeaf(leaf.origin) < 0;
  if (missing == 0) return;
  auto& values = valuesAs<T>(field.values);
  size_t from = field.leafCount(), to = from + missing, change = changes.leaves.size();
  field.leafOrigins.resize(to);
  values.resize(to * kLeafVoxels);
  while (to > from) {
    --to;
    while (change > 0 && from > 0 &&
           lessZYX(changes.leaves[change - 1].origin, field.leafOrigins[from - 1])) {
      field.leafOrigins[to] = field.leafOrigins[from - 1];
      std::memcpy(&values[to * kLeafVoxels], &values[(from - 1) * kLeafVoxels], kLeafVoxels * sizeof(T));
      --from;
      --to;
    }
    // Everything still stored now stands at or before the next change.
    const Vec3i origin = changes.leaves[change - 1].origin;
    const bool stored = from > 0 && field.leafOrigins[from - 1] == origin;
    field.leafOrigins[to] = origin;
    if (stored) {
      --from;
      std::memmove(&values[to * kLeafVoxels], &values[from * kLeafVoxels], kLeafVoxels * sizeof(T));
    } else {
      std::fill_n(values.begin() + int64_t(to * kLeafVoxels), kLeafVoxels, T(field.background));
    }
    --change;
  }
}

}  // namespace

void applyChanges(const ChangedVoxels& changes, Field& field) {
  if (changes.type() != field.type())
    throw StateError("changed voxels hold " + std::string(name(changes.type())) +
                     " values, the field holds " + std::string(name(field.type())));
  dispatch(field.type(), [&]<class T>() {
    addMissingLeaves<T>(changes, field);
    auto& values = valuesAs<T>(field.values);
    const auto& newValues = valuesAs<T>(changes.values);
    for (const ChangedLeaf& leaf : changes.leaves)
      writeLeaf(leaf, &newValues[leaf.first], &values[size_t(field.findLeaf(leaf.origin)) * kLeafVoxels]);
  });
  field.bounds = unite(field.bounds, changes.bounds());
}

}  // namespace kairos
