// OpenVDB's order of a leaf's voxels (z fastest) and ours (x fastest).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "volume/field.h"

namespace kairos {

/// Bit or value number i of a leaf belongs to voxel (i / 64, i / 8 % 8, i % 8): OpenVDB's order.
inline constexpr int kVdbLeafVoxels = 512;
using VdbLeafMask = std::array<uint64_t, kVdbLeafVoxels / 64>;

constexpr int vdbOffset(int x, int y, int z) {
  return x * 64 + y * 8 + z;
}

/// OpenVDB's offset of our offset.
constexpr int vdbOffsetOf(int offset) {
  return vdbOffset(offset & 7, (offset >> 3) & 7, offset >> 6);
}

/// Transposes an 8 x 8 matrix of bits, row by row in the bytes of `m` (Warren, Hacker's Delight, 7-3).
constexpr uint64_t transposedBits(uint64_t m) {
  uint64_t t = (m ^ (m >> 7)) & 0x00aa00aa00aa00aa;
  m ^= t ^ (t << 7);
  t = (m ^ (m >> 14)) & 0x0000cccc0000cccc;
  m ^= t ^ (t << 14);
  t = (m ^ (m >> 28)) & 0x00000000f0f0f0f0;
  return m ^ t ^ (t << 28);
}

/// A mask in the other of the two orders (words x, bytes y, bits z, or words z, bytes y, bits x).
constexpr VdbLeafMask reorderedMask(const VdbLeafMask& mask) {
  VdbLeafMask reordered{};
  for (int y = 0; y < kLeafEdge; ++y) {
    uint64_t plane = 0;  // row: word, bit
    for (size_t w = 0; w < 8; ++w) plane |= (mask[w] >> (8 * y) & 0xff) << (8 * w);
    plane = transposedBits(plane);
    for (size_t w = 0; w < 8; ++w) reordered[w] |= (plane >> (8 * w) & 0xff) << (8 * y);
  }
  return reordered;
}

/// The values of a mask's voxels, packed in our order, into their places in OpenVDB's. `mask` is in our
/// order.
template <class T>
void placeInVdbOrder(const VdbLeafMask& mask, const T* packed, float* leaf) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (int y = 0; y < kLeafEdge; ++y) {
      uint64_t row = mask[size_t(z)] >> (kLeafEdge * y) & 0xff;
      float* to = leaf + vdbOffset(0, y, z);
      constexpr int kNextX = vdbOffset(1, 0, 0);
      if (row == 0xff)  // by far the most frequent; without a search for the bits
        for (int x = 0; x < kLeafEdge; ++x) to[kNextX * x] = float(*packed++);
      else
        for (; row != 0; row &= row - 1) to[kNextX * std::countr_zero(row)] = float(*packed++);
    }
}

/// Packs the values of a mask's voxels; mask, leaf and result are in the same order. Returns the place
/// behind.
template <class T>
T* packRows(const VdbLeafMask& mask, const T* leaf, T* packed) {
  for (size_t i = 0; i < size_t(kVdbLeafVoxels); i += 8) {
    uint64_t row = mask[i / 64] >> (i % 64) & 0xff;
    if (row == 0xff)
      packed = std::copy_n(leaf + i, 8, packed);
    else
      for (; row != 0; row &= row - 1) *packed++ = leaf[i + size_t(std::countr_zero(row))];
  }
  return packed;
}

}  // namespace kairos
