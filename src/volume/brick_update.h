// Writing new values into one brick, its value ranges included.
#pragma once

#include <cstdint>
#include <span>

#include "volume/brick_ranges.h"

namespace kairos {

/// A leaf to be written: its mask and packed values as in ChangedLeaf.
struct LeafView {
  Vec3i origin;
  const uint64_t* mask;
  const void* values;
};

template <class T>
struct BrickUpdate {
  T* brick;  // 20^3 values, and at least 8 more that may be read and written back
  BlockRanges<T>& ranges;
  Vec3i origin;  // voxel index of the brick's first voxel
  T background;  // what NaN and infinities are stored as
  /// The leaves that share voxels with the brick, as numbers into `leaves`.
  std::span<const uint32_t> placements;
  std::span<const LeafView> leaves;
  const T* valuesEnd;      // the end of the array that all leaves' values stand in
  const VoxelBox* domain;  // of dense data, whose outermost voxels are repeated outside; else null
};

/// What an update did to a brick.
struct BrickChange {
  uint64_t subBlocks, windows;  // as in DirtyBricks
  ValueRange range;             // of all its values
};

/// Writes the values that belong to the brick or its apron, then refreshes the ranges of the blocks they fall
/// in. Allocates nothing. The result is the same on every instruction set.
BrickChange updateBrick(const BrickUpdate<uint8_t>& update);
BrickChange updateBrick(const BrickUpdate<uint16_t>& update);
BrickChange updateBrick(const BrickUpdate<float>& update);

}  // namespace kairos
