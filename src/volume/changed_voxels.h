// The changed voxels of one time step: what a differential file holds.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "volume/field.h"

namespace kairos {

/// The changed voxels of one 8^3 leaf. Word z of `mask` has bit (x + 8 y) set when voxel (x, y, z) changed.
/// Their new values stand packed in offset order at [first, first + count()) of ChangedVoxels::values.
struct ChangedLeaf {
  Vec3i origin;
  std::array<uint64_t, 8> mask{};
  uint64_t first = 0;

  int count() const {
    int n = 0;
    for (uint64_t word : mask) n += std::popcount(word);
    return n;
  }
};

/// Changed voxels and their new values; leaves sorted (lessZYX), unique and non-empty. Voxel number i of the
/// whole set is found in O(log leaves) by `locate`, which random sampling without replacement needs.
struct ChangedVoxels {
  std::vector<ChangedLeaf> leaves;
  VoxelArray values;

  /// stateChecksum of the field before and after, where known; applying to another state is a StateError.
  std::optional<uint64_t> stateBefore, stateAfter;

  ElementType type() const { return elementType(values); }
  uint64_t count() const { return size(values); }
  bool empty() const { return leaves.empty(); }
  /// Position of changed voxel number i (0 <= i < count()).
  Vec3i locate(uint64_t i) const;
  /// Smallest box that holds all changed voxels' leaves.
  VoxelBox bounds() const;
};

/// 64-bit hash of positions and new values, which a differential file carries so that damage is noticed.
uint64_t contentChecksum(const ChangedVoxels& changes);

/// Writes the new values into `field`, adding leaves where needed. Throws StateError when the element types
/// differ. Leaves that return to the background stay stored (their values are the background's).
void applyChanges(const ChangedVoxels& changes, Field& field);

}  // namespace kairos
