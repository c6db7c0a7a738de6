// Keeping account of which voxels of a brick an update wrote.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "volume/brick_ranges.h"

namespace kairos {

/// Which voxels of a brick were written: a mask of 20 bits along x for each group of rows, once for the
/// sub-blocks (groups of 5 x 5 rows) and once for the blocks (4 x 4).
class TouchedRows {
 public:
  void add(int y, int z, uint32_t row) {
    subBlocks_[size_t(z / kSubBlockEdge * 4 + y / kSubBlockEdge)] |= row;
    blocks_[size_t(z / kWindowBlock * kBlocks + y / kWindowBlock)] |= row;
  }
  /// The same of all rows in [y, y + count).
  void add(int y, int count, int z, uint32_t row) {
    for (int g = y / kSubBlockEdge; g <= (y + count - 1) / kSubBlockEdge; ++g)
      subBlocks_[size_t(z / kSubBlockEdge * 4 + g)] |= row;
    for (int g = y / kWindowBlock; g <= (y + count - 1) / kWindowBlock; ++g)
      blocks_[size_t(z / kWindowBlock * kBlocks + g)] |= row;
  }

  /// What was written in plane `from` of an axis was written in plane `to` too. Marks along y and z are those
  /// of the whole group.
  void repeat(int axis, int from, int to) {
    const auto alongX = [&](uint32_t& row) { row |= (row >> from & 1) << to; };
    if (axis == 0) {
      std::for_each(subBlocks_.begin(), subBlocks_.end(), alongX);
      std::for_each(blocks_.begin(), blocks_.end(), alongX);
      return;
    }
    const auto alongGroups = [&](auto& groups, int edge, int count) {
      const int stride = axis == 1 ? 1 : count, other = axis == 1 ? count : 1;
      for (int i = 0; i < count; ++i)
        groups[size_t(to / edge * stride + i * other)] |= groups[size_t(from / edge * stride + i * other)];
    };
    alongGroups(subBlocks_, kSubBlockEdge, 4);
    alongGroups(blocks_, kWindowBlock, kBlocks);
  }

  /// Was anything in this row of blocks written?
  bool blockRow(int by, int bz) const { return blocks_[size_t(bz * kBlocks + by)] != 0; }

  uint64_t subBlockMask() const {
    uint64_t mask = 0;
    for (size_t g = 0; g < subBlocks_.size(); ++g) {
      const uint32_t row = subBlocks_[g];
      const uint64_t four = uint64_t((row & 0x1f) != 0) | uint64_t((row & 0x3e0) != 0) << 1 |
                            uint64_t((row & 0x7c00) != 0) << 2 | uint64_t((row & 0xf8000) != 0) << 3;
      mask |= four << (4 * g);
    }
    return mask;
  }

  /// The windows that contain a block which was written.
  uint64_t windowMask() const {
    uint32_t planes[kBlocks] = {};  // bit x + 5 y
    for (size_t g = 0; g < blocks_.size(); ++g)
      for (int x = 0; x < kBlocks; ++x)
        planes[g / kBlocks] |= uint32_t((blocks_[g] >> (kWindowBlock * x) & 0xf) != 0)
                               << (size_t(x) + kBlocks * (g % kBlocks));
    uint64_t mask = 0;
    for (int z = 0; z < kBlocks - 1; ++z) {
      uint32_t plane = planes[z] | planes[z + 1];
      plane |= plane >> kBlocks;
      plane |= plane >> 1;
      for (int y = 0; y < 4; ++y) mask |= uint64_t(plane >> (kBlocks * y) & 0xf) << (4 * y + 16 * z);
    }
    return mask;
  }

 private:
  std::array<uint32_t, 16> subBlocks_{};
  std::array<uint32_t, kBlocks * kBlocks> blocks_{};
};

}  // namespace kairos
