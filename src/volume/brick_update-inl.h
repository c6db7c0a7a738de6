// Per-target code of brick updates; included once per instruction set. See brick_update.cpp.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_BRICK_UPDATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_BRICK_UPDATE_INL_H_
#undef KAIROS_BRICK_UPDATE_INL_H_
#else
#define KAIROS_BRICK_UPDATE_INL_H_
#endif
// NOLINTEND

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "volume/touched_rows.h"

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// ---- rows of a leaf ----

// NaN and infinities become the background. A comparison rather than isfinite, so that rows are converted by
// vector instructions.
template <class T>
HWY_INLINE T stored(T value, T background) {
  if constexpr (std::is_floating_point_v<T>)
    return std::abs(value) <= std::numeric_limits<T>::max() ? value : background;
  return value;
}

#undef KAIROS_ROW_IN_REGISTER
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
#define KAIROS_ROW_IN_REGISTER 1
#else
#define KAIROS_ROW_IN_REGISTER 0
#endif

#if KAIROS_ROW_IN_REGISTER

// For each 8-bit mask, which packed value each of the 8 places takes, in elements of `kBytes` bytes.
template <int kBytes>
struct ExpandTable {
  alignas(64) uint8_t bytes[256][8 * kBytes];
};
template <int kBytes>
constexpr ExpandTable<kBytes> expandTable() {
  ExpandTable<kBytes> table{};
  for (int row = 0; row < 256; ++row)
    for (int x = 0, next = 0; x < 8; ++x) {
      const int from = row >> x & 1 ? next++ : 0;
      for (int b = 0; b < kBytes; ++b) table.bytes[row][x * kBytes + b] = uint8_t(from * kBytes + b);
    }
  return table;
}

// Spreads packed values over the columns set in `row`; what the other columns get has no meaning.
HWY_INLINE auto expanded(uint32_t row, const float* packed) {
  static constexpr auto kTable = expandTable<1>();
  const hn::CappedTag<float, kLeafEdge> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto places = hn::PromoteTo(di, hn::Load(hn::Rebind<uint8_t, decltype(d)>(), kTable.bytes[row]));
  return hn::TableLookupLanes(hn::LoadU(d, packed), hn::IndicesFromVec(d, places));
}
template <class T>
HWY_INLINE auto expanded(uint32_t row, const T* packed) {
  static constexpr auto kTable = expandTable<sizeof(T)>();
  const hn::CappedTag<T, kLeafEdge> d;
  const hn::Repartition<uint8_t, decltype(d)> bytes;
  return hn::BitCast(
      d, hn::TableLookupBytes(hn::BitCast(bytes, hn::LoadU(d, packed)), hn::Load(bytes, kTable.bytes[row])));
}

template <class D, class V>
HWY_INLINE V storedVector(D d, V values, hn::TFromD<D> background) {
  if constexpr (std::is_floating_point_v<hn::TFromD<D>>)
    return hn::IfThenElse(hn::Le(hn::Abs(values), hn::Set(d, std::numeric_limits<float>::max())), values,
                          hn::Set(d, background));
  else
    return values;
}

template <class T>
HWY_INLINE void storeWholeRow(const T* values, T background, T* out) {
  const hn::CappedTag<T, kLeafEdge> d;
  hn::StoreU(storedVector(d, hn::LoadU(d, values), background), d, out);
}

// Writes the columns in `row`; the others are read and written back, up to 8 from `out` on. Without branches,
// since most rows at a change's edge differ from the one before.
template <class T>
HWY_INLINE void storeColumns(uint32_t row, uint32_t columns, const T* values, const T* valuesEnd,
                             T background, T* out) {
  const hn::CappedTag<T, kLeafEdge> d;
  T last[kLeafEdge] = {};
  if (HWY_UNLIKELY(valuesEnd - values < kLeafEdge)) {
    std::copy(values, valuesEnd, last);
    values = last;
  }
  const auto bits = uint8_t(row & columns);
  const uint8_t maskBytes[8] = {bits};
  hn::StoreU(hn::IfThenElse(hn::LoadMaskBits(d, maskBytes),
                            storedVector(d, expanded(row, values), background), hn::LoadU(d, out)),
             d, out);
}

#else  // rows do not fit one register

template <class T>
HWY_INLINE void storeWholeRow(const T* values, T background, T* out) {
  T row[kLeafEdge];
  for (int x = 0; x < kLeafEdge; ++x) row[x] = stored(values[x], background);
  std::copy_n(row, kLeafEdge, out);
}

template <class T>
HWY_INLINE void storeColumns(uint32_t row, uint32_t columns, const T* values, const T*, T background,
                             T* out) {
  for (uint32_t rest = row & columns; rest != 0; rest &= rest - 1)
    out[std::countr_zero(rest)] = stored(*values++, background);
}

#endif

// How many bits are set in each byte of `word`.
HWY_INLINE uint64_t bitsOfBytes(uint64_t word) {
  word -= word >> 1 & 0x5555555555555555;
  word = (word & 0x3333333333333333) + (word >> 2 & 0x3333333333333333);
  return (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0f;
}

// Writes the part of a leaf that belongs to the brick or its apron.
template <class T>
HWY_INLINE void storeLeaf(const BrickUpdate<T>& update, const LeafView& leaf, TouchedRows& touched) {
  const Vec3i at = leaf.origin - update.origin;  // 0, 8 or 16 on each axis; from 16 on only a half is ours
  const int rows = std::min(kLeafEdge, kBrickStride - at.y),
            planes = std::min(kLeafEdge, kBrickStride - at.z);
  const uint32_t columns = at.x + kLeafEdge <= kBrickStride ? 0xff : 0x0f;
  const T* values = static_cast<const T*>(leaf.values);
  for (int z = 0; z < planes; ++z) {
    const uint64_t word = leaf.mask[z];
    T* out = update.brick + ((at.z + z) * kBrickStride + at.y) * kBrickStride + at.x;
    if (word == ~uint64_t(0) && columns == 0xff) {
      for (int y = 0; y < rows; ++y)
        storeWholeRow(values + y * kLeafEdge, update.background, out + y * kBrickStride);
      touched.add(at.y, rows, at.z + z, columns << at.x);
      values += kLeafEdge * kLeafEdge;
    } else if (word != 0) {
      const uint64_t bits = bitsOfBytes(word), below = bits * 0x0101010101010100;  // in the rows before each
      for (int y = 0; y < rows; ++y) {
        const auto row = uint32_t(word >> (8 * y)) & 0xff;
        if ((row & columns) == 0) continue;
        storeColumns(row, columns, values + (below >> (8 * y) & 0xff), update.valuesEnd, update.background,
                     out + y * kBrickStride);
        touched.add(at.y + y, at.z + z, (row & columns) << at.x);
      }
      values += bits * 0x0101010101010101 >> 56;
    }
  }
}

// ---- faces of dense data ----

// Copies plane `from` of an axis to plane `to`, both counted in the brick's voxels.
template <class T>
HWY_INLINE void copyPlane(int axis, int from, int to, T* brick) {
  const int strides[3] = {1, kBrickStride, kBrickStride * kBrickStride};
  const int u = strides[(axis + 1) % 3], v = strides[(axis + 2) % 3], shift = (to - from) * strides[axis];
  for (int j = 0; j < kBrickStride; ++j)
    for (int i = 0; i < kBrickStride; ++i) {
      T* source = brick + from * strides[axis] + i * u + j * v;
      source[shift] = *source;
    }
}

// Repeats the outermost voxels in the layer outside.
template <class T>
HWY_INLINE void repeatFaces(const BrickUpdate<T>& update, TouchedRows& touched) {
  const auto repeat = [&](int axis, int from, int to) {
    if (std::min(from, to) < 0 || std::max(from, to) >= kBrickStride) return;
    copyPlane(axis, from, to, update.brick);
    touched.repeat(axis, from, to);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int first = update.domain->lo[axis] - update.origin[axis],
              last = update.domain->hi[axis] - 1 - update.origin[axis];
    repeat(axis, first, first - 1);
    repeat(axis, last, last + 1);
  }
}

// ---- value ranges ----

// Recomputes the five blocks in one row of blocks.
template <class T>
HWY_INLINE void refreshBlockRow(const T* brick, int by, int bz, BlockRanges<T>& ranges) {
  const T* first = brick + (bz * kBrickStride + by) * kWindowBlock * kBrickStride;
  T lo[kBrickStride], hi[kBrickStride];
  std::copy_n(first, kBrickStride, lo);
  std::copy_n(first, kBrickStride, hi);
  for (int z = 0; z < kWindowBlock; ++z)
    for (int y = 0; y < kWindowBlock; ++y) {
      const T* row = first + (z * kBrickStride + y) * kBrickStride;
      for (int x = 0; x < kBrickStride; ++x) {
        lo[x] = lo[x] < row[x] ? lo[x] : row[x];
        hi[x] = hi[x] > row[x] ? hi[x] : row[x];
      }
    }
  const int number = kBlocks * (by + kBlocks * bz);
  for (int b = 0; b < kBlocks; ++b) {
    const T *l = lo + b * kWindowBlock, *h = hi + b * kWindowBlock;
    ranges.lo[number + b] = smaller(smaller(l[0], l[1]), smaller(l[2], l[3]));
    ranges.hi[number + b] = larger(larger(h[0], h[1]), larger(h[2], h[3]));
  }
}

// Range of the whole brick; refreshes the padding.
template <class T>
HWY_INLINE ValueRange rangeOfAll(BlockRanges<T>& ranges) {
  using R = BlockRanges<T>;
  std::fill_n(ranges.lo + R::kCount, R::kPadded - R::kCount, ranges.lo[R::kCount - 1]);
  std::fill_n(ranges.hi + R::kCount, R::kPadded - R::kCount, ranges.hi[R::kCount - 1]);
  T lo[R::kPadded], hi[R::kPadded];
  std::copy_n(ranges.lo, R::kPadded, lo);
  std::copy_n(ranges.hi, R::kPadded, hi);
  for (int n = R::kPadded / 2; n >= 1; n /= 2)
    for (int i = 0; i < n; ++i) {
      lo[i] = lo[i] < lo[i + n] ? lo[i] : lo[i + n];
      hi[i] = hi[i] > hi[i + n] ? hi[i] : hi[i + n];
    }
  return {float(lo[0]), float(hi[0])};
}

template <class T>
HWY_INLINE BrickChange update(const BrickUpdate<T>& update) {
  TouchedRows touched;
  for (const uint32_t placement : update.placements) storeLeaf(update, update.leaves[placement], touched);
  if (update.domain) repeatFaces(update, touched);
  for (int z = 0; z < kBlocks; ++z)
    for (int y = 0; y < kBlocks; ++y)
      if (touched.blockRow(y, z)) refreshBlockRow(update.brick, y, z, update.ranges);
  return {touched.subBlockMask(), touched.windowMask(), rangeOfAll(update.ranges)};
}

BrickChange updateU8(const BrickUpdate<uint8_t>& u) {
  return update(u);
}
BrickChange updateU16(const BrickUpdate<uint16_t>& u) {
  return update(u);
}
BrickChange updateF32(const BrickUpdate<float>& u) {
  return update(u);
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // include guard
