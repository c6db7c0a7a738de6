// Value ranges inside one brick: of its blocks of 4^3 voxels, and from them those of its windows.
#pragma once

#include <algorithm>
#include <array>

#include "volume/brick_volume.h"

namespace kairos {

inline constexpr int kBlocks = kBrickStride / kWindowBlock;  // along a brick's edge, apron included

/// Smallest and largest value of each block, in the voxels' own type; block (x, y, z) is number
/// x + 5 y + 25 z. The entries behind the last repeat it.
template <class T>
struct BlockRanges {
  static constexpr int kCount = kBlocks * kBlocks * kBlocks, kPadded = 128;
  T lo[kPadded], hi[kPadded];

  void fill(T value) {
    std::fill_n(lo, kPadded, value);
    std::fill_n(hi, kPadded, value);
  }
};

// In this form of minimum and maximum, loops over whole rows stay in vector registers.
template <class T>
constexpr T smaller(T a, T b) {
  return a < b ? a : b;
}
template <class T>
constexpr T larger(T a, T b) {
  return a > b ? a : b;
}

/// Ranges of all windows: a window is 2^3 blocks. One axis after the other; what wraps around the end of a
/// row or plane is not used.
template <class T>
std::array<ValueRange, kWindows> windowsOf(const BlockRanges<T>& ranges) {
  constexpr int kRow = kBlocks, kPlane = kBlocks * kBlocks, kPlanes = kPlane * (kBlocks - 1);
  T lo[kPlanes], hi[kPlanes];
  for (int i = 0; i < kPlanes; ++i) {
    lo[i] = smaller(ranges.lo[i], ranges.lo[i + kPlane]);
    hi[i] = larger(ranges.hi[i], ranges.hi[i + kPlane]);
  }
  for (const int step : {kRow, 1})
    for (int i = 0; i + step < kPlanes; ++i) {
      lo[i] = smaller(lo[i], lo[i + step]);
      hi[i] = larger(hi[i], hi[i + step]);
    }
  std::array<ValueRange, kWindows> windows;
  for (int z = 0; z < kBlocks - 1; ++z)
    for (int y = 0; y < kBlocks - 1; ++y)
      for (int x = 0; x < kBlocks - 1; ++x) {
        const int i = x + kRow * y + kPlane * z;
        windows[size_t(x + 4 * y + 16 * z)] = {float(lo[i]), float(hi[i])};
      }
  return windows;
}

}  // namespace kairos
