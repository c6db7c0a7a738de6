// Samplers of the packet kernel: a packet's footprints fetched by plain loads of a few rows into registers,
// every lane's corners picked from there by permutes. Included by kernel_packet-inl.h.
//
// A block is `planes` planes of rows along x. The row and plane axes are y and z, or z and y: the row axis
// must be the one along which the packet is less than two voxels wide.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_PACKET_BLOCK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_PACKET_BLOCK_INL_H_
#undef KAIROS_PACKET_BLOCK_INL_H_
#else
#define KAIROS_PACKET_BLOCK_INL_H_
#endif
// NOLINTEND

#include <cstdint>

#include "volume/brick_volume.h"

#if HWY_TARGET == HWY_AVX3_DL

#include <immintrin.h>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

struct BlockShape {
  int rowAxis, planeAxis;
  int rowStride, planeStride;
};

constexpr int kStrideOf[3] = {1, kBrickStride, kBrickStride* kBrickStride};

HWY_INLINE __m512 lerp(__m512 a, __m512 b, __m512 f) {
  return _mm512_fmadd_ps(f, _mm512_sub_ps(b, a), a);
}

// Positions in float: relative to the block's base corner, whole part and fraction.
struct FloatPlaces {
  __m512 whole[3], fraction[3];
};

// Positions in fixed point, 8 bits before and 24 behind the point; whole parts relative to the block's base
// corner side by side in bytes 0 to 2.
struct FixedPlaces {
  __m512i at[3], whole;

  // 15 bits of one axis' fraction in both halves of each lane.
  HWY_INLINE __m512i weight(int axis) const {
    const __m512i middle = _mm512_set4_epi32(0x0e0d0e0d, 0x0a090a09, 0x06050605, 0x02010201);
    return _mm512_srli_epi16(_mm512_shuffle_epi8(at[axis], middle), 1);
  }
  // One axis' fraction, times 2^32.
  HWY_INLINE __m512 scaledFraction(int axis) const {
    return _mm512_cvtepu32_ps(_mm512_slli_epi32(at[axis], 8));
  }
  // Offsets in a block, `x`, `row` and `plane` apart along the axes.
  HWY_INLINE __m512i offsets(const BlockShape& s, int row, int plane) const {
    const int factors = 1 | row << (8 * s.rowAxis) | plane << (8 * s.planeAxis);
    return _mm512_dpbusd_epi32(_mm512_setzero_si512(), whole, _mm512_set1_epi32(factors));
  }
};

// Which of a block's planes each lane's footprint starts in, as masks for choosing among the planes'
// candidates.
struct PlaneChoice {
  __mmask16 one, two, three;
  HWY_INLINE explicit PlaneChoice(__m512 whole)
      : one(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(1), _CMP_GE_OQ)),
        two(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(2), _CMP_GE_OQ)),
        three(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(3), _CMP_GE_OQ)) {}
  HWY_INLINE PlaneChoice(__m512i whole, int axis) {
    const __m512i plane =
        _mm512_and_si512(_mm512_srli_epi32(whole, unsigned(8 * axis)), _mm512_set1_epi32(3));
    one = _mm512_cmpge_epi32_mask(plane, _mm512_set1_epi32(1));
    two = _mm512_cmpge_epi32_mask(plane, _mm512_set1_epi32(2));
    three = _mm512_cmpge_epi32_mask(plane, _mm512_set1_epi32(3));
  }
  // candidates[0..3] hold what a lane finds when it starts in that plane.
  template <int kPlanes>
  HWY_INLINE __m512i choose(const __m512i* candidates) const {
    __m512i v = _mm512_mask_mov_epi32(candidates[0], one, candidates[1]);
    v = _mm512_mask_mov_epi32(v, two, candidates[2]);
    if constexpr (kPlanes == 5) v = _mm512_mask_mov_epi32(v, three, candidates[3]);
    return v;
  }
};

// Eight corners to a value: x fastest, then row, then plane.
HWY_INLINE __m512 interpolate(const __m512 (&c)[8], __m512 fx, __m512 fRow, __m512 fPlane) {
  return lerp(lerp(lerp(c[0], c[1], fx), lerp(c[2], c[3], fx), fRow),
              lerp(lerp(c[4], c[5], fx), lerp(c[6], c[7], fx), fRow), fPlane);
}

// What every sampler tells: its element type, how it wants positions, and how what `sample` returns becomes a
// value: (sample - kZero) * kUnit.
template <class T>
struct FullBlock {
  using Element = T;
  using Places = FloatPlaces;
  static constexpr float kUnit = 1, kZero = 0;
};

HWY_INLINE __m512 fourRows(const float* p, int stride) {
  __m512 v = _mm512_castps128_ps512(_mm_loadu_ps(p));
  v = _mm512_insertf32x4(v, _mm_loadu_ps(p + stride), 1);
  v = _mm512_insertf32x4(v, _mm_loadu_ps(p + 2 * stride), 2);
  return _mm512_insertf32x4(v, _mm_loadu_ps(p + 3 * stride), 3);
}

// f32, packets less than two voxels wide on every axis: 4^3 voxels in four registers.
struct CompactF32 : FullBlock<float> {
  static HWY_INLINE __m512 sample(const float* base, const BlockShape& s, const FloatPlaces& at) {
    const __m512 p0 = fourRows(base, s.rowStride), p1 = fourRows(base + s.planeStride, s.rowStride),
                 p2 = fourRows(base + 2 * s.planeStride, s.rowStride),
                 p3 = fourRows(base + 3 * s.planeStride, s.rowStride);
    const __m512 index =
        _mm512_fmadd_ps(at.whole[s.planeAxis], _mm512_set1_ps(16),
                        _mm512_fmadd_ps(at.whole[s.rowAxis], _mm512_set1_ps(4), at.whole[0]));
    const __m512i near = _mm512_cvttps_epi32(index), far = _mm512_add_epi32(near, _mm512_set1_epi32(16));
    const __mmask16 nearUpper = _mm512_test_epi32_mask(near, _mm512_set1_epi32(32));
    const __mmask16 farUpper = _mm512_test_epi32_mask(far, _mm512_set1_epi32(32));
    const auto pick = [&](__m512i i, __mmask16 upper, int offset) HWY_ATTR {
      const __m512i ii = _mm512_add_epi32(i, _mm512_set1_epi32(offset));
      return _mm512_mask_blend_ps(upper, _mm512_permutex2var_ps(p0, ii, p1),
                                  _mm512_permutex2var_ps(p2, ii, p3));
    };
    const __m512 c[8] = {pick(near, nearUpper, 0), pick(near, nearUpper, 1), pick(near, nearUpper, 4),
                         pick(near, nearUpper, 5), pick(far, farUpper, 0),   pick(far, farUpper, 1),
                         pick(far, farUpper, 4),   pick(far, farUpper, 5)};
    return interpolate(c, at.fraction[0], at.fraction[s.rowAxis], at.fraction[s.planeAxis]);
  }
};

// f32, packets up to six voxels wide along x: rows of eight, four rows a plane.
template <int kPlanes>
struct WideF32 : FullBlock<float> {
  static HWY_INLINE __m512 sample(const float* base, const BlockShape& s, const FloatPlaces& at) {
    const __m512i index =
        _mm512_cvttps_epi32(_mm512_fmadd_ps(at.whole[s.rowAxis], _mm512_set1_ps(8), at.whole[0]));
    const int offsets[4] = {0, 1, 8, 9};
    __m512i found[4][kPlanes];
    for (int p = 0; p < kPlanes; ++p) {
      const float* plane = base + p * s.planeStride;
      const auto twoRows = [&](const float* row) HWY_ATTR {
        return _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(row)),
                                  _mm256_loadu_ps(row + s.rowStride), 1);
      };
      const __m512 low = twoRows(plane), high = twoRows(plane + 2 * s.rowStride);
      for (int c = 0; c < 4; ++c)
        found[c][p] = _mm512_castps_si512(
            _mm512_permutex2var_ps(low, _mm512_add_epi32(index, _mm512_set1_epi32(offsets[c])), high));
    }
    const PlaneChoice choice(at.whole[s.planeAxis]);
    __m512 c[8];
    for (int i = 0; i < 4; ++i) {
      c[i] = _mm512_castsi512_ps(choice.choose<kPlanes>(found[i]));
      c[i + 4] = _mm512_castsi512_ps(choice.choose<kPlanes>(found[i] + 1));
    }
    return interpolate(c, at.fraction[0], at.fraction[s.rowAxis], at.fraction[s.planeAxis]);
  }
};

// u16: rows of eight, four rows in one register a plane; a permute finds both neighbours along x at once.
// pairs[0], [1]: the near plane's two rows; [2], [3] the far plane's.
template <int kPlanes>
HWY_INLINE void pairsOfU16(const uint16_t* base, const BlockShape& s, __m512i index,
                           const PlaneChoice& choice, __m512i (&pairs)[4]) {
  const __m512i nextRow = _mm512_add_epi32(index, _mm512_set1_epi32(0x80008));
  __m512i found[2][kPlanes];
  for (int p = 0; p < kPlanes; ++p) {
    const uint16_t* row = base + p * s.planeStride;
    const auto load = [&](int r) HWY_ATTR {
      return _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + r * s.rowStride));
    };
    __m512i plane = _mm512_castsi128_si512(load(0));
    plane = _mm512_inserti32x4(plane, load(1), 1);
    plane = _mm512_inserti32x4(plane, load(2), 2);
    plane = _mm512_inserti32x4(plane, load(3), 3);
    found[0][p] = _mm512_permutexvar_epi16(index, plane);
    found[1][p] = _mm512_permutexvar_epi16(nextRow, plane);
  }
  for (int i = 0; i < 4; ++i) pairs[i] = choice.choose<kPlanes>(found[i & 1] + (i >> 1));
}

template <int kPlanes>
struct PacketU16 : FullBlock<uint16_t> {
  static HWY_INLINE __m512 sample(const uint16_t* base, const BlockShape& s, const FloatPlaces& at) {
    __m512i index = _mm512_cvttps_epi32(_mm512_fmadd_ps(at.whole[s.rowAxis], _mm512_set1_ps(8), at.whole[0]));
    index =
        _mm512_add_epi32(_mm512_or_si512(index, _mm512_slli_epi32(index, 16)), _mm512_set1_epi32(0x10000));
    __m512i pairs[4];
    pairsOfU16<kPlanes>(base, s, index, PlaneChoice(at.whole[s.planeAxis]), pairs);
    const __m512i low = _mm512_set1_epi32(0xffff);
    __m512 c[8];
    for (int i = 0; i < 4; ++i) {
      c[2 * i] = _mm512_cvtepi32_ps(_mm512_and_si512(pairs[i], low));
      c[2 * i + 1] = _mm512_cvtepi32_ps(_mm512_srli_epi32(pairs[i], 16));
    }
    return interpolate(c, at.fraction[0], at.fraction[s.rowAxis], at.fraction[s.planeAxis]);
  }
};

// u8: whole planes by loads of 64 bytes; a permute finds the four corners of a plane at once, one a byte:
// (x, y), (x, y + 1), (x + 1, y), (x + 1, y + 1).
constexpr int kCornersU8 = (kBrickStride + 1) << 24 | 1 << 16 | kBrickStride << 8;
struct CornersU8 {
  __m512i near, far;
};

// `index` has each lane's offset of (x, y) in its near plane in all four bytes, planes 64 apart.
HWY_INLINE CornersU8 compactCornersU8(const uint8_t* base, __m512i index) {
  constexpr int kPlane = kBrickStride * kBrickStride;
  const __m512i p0 = _mm512_loadu_si512(base), p1 = _mm512_loadu_si512(base + kPlane),
                p2 = _mm512_loadu_si512(base + 2 * kPlane), p3 = _mm512_loadu_si512(base + 3 * kPlane);
  const auto pick = [&](__m512i i) HWY_ATTR {
    return _mm512_mask_blend_epi8(_mm512_movepi8_mask(i), _mm512_permutex2var_epi8(p0, i, p1),
                                  _mm512_permutex2var_epi8(p2, i, p3));
  };
  const __m512i near = _mm512_add_epi8(index, _mm512_set1_epi32(kCornersU8));
  return {pick(near), pick(_mm512_add_epi8(near, _mm512_set1_epi8(64)))};
}

// `index` likewise, but within the plane that `choice` says.
HWY_INLINE CornersU8 wideCornersU8(const uint8_t* base, __m512i index, const PlaneChoice& choice) {
  const __m512i corners = _mm512_add_epi8(index, _mm512_set1_epi32(kCornersU8));
  __m512i found[5];
  for (int p = 0; p < 5; ++p) {
    const uint8_t* plane = base + p * kBrickStride * kBrickStride;
    found[p] = _mm512_permutex2var_epi8(_mm512_loadu_si512(plane), corners, _mm512_loadu_si512(plane + 64));
  }
  return {choice.choose<5>(found), choice.choose<5>(found + 1)};
}

HWY_INLINE __m512i inAllBytes(__m512i lowByte) {
  return _mm512_shuffle_epi8(lowByte, _mm512_set4_epi32(0x0c0c0c0c, 0x08080808, 0x04040404, 0));
}

HWY_INLINE __m512i offsetsU8(const FloatPlaces& at, float plane) {
  return inAllBytes(_mm512_cvttps_epi32(
      _mm512_fmadd_ps(at.whole[2], _mm512_set1_ps(plane),
                      _mm512_fmadd_ps(at.whole[1], _mm512_set1_ps(kBrickStride), at.whole[0]))));
}

HWY_INLINE __m512 interpolateU8(const CornersU8& corners, const FloatPlaces& at) {
  const __m512i byte = _mm512_set1_epi32(0xff);
  const auto corner = [&](__m512i v, unsigned shift) HWY_ATTR {
    return _mm512_cvtepi32_ps(_mm512_and_si512(_mm512_srli_epi32(v, shift), byte));
  };
  const auto [near, far] = corners;
  const __m512 c[8] = {corner(near, 0), corner(near, 16), corner(near, 8), corner(near, 24),
                       corner(far, 0),  corner(far, 16),  corner(far, 8),  corner(far, 24)};
  return interpolate(c, at.fraction[0], at.fraction[1], at.fraction[2]);
}

struct CompactU8 : FullBlock<uint8_t> {
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape&, const FloatPlaces& at) {
    return interpolateU8(compactCornersU8(base, offsetsU8(at, 64)), at);
  }
};

struct WideU8 : FullBlock<uint8_t> {
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape&, const FloatPlaces& at) {
    return interpolateU8(wideCornersU8(base, offsetsU8(at, 0), PlaneChoice(at.whole[2])), at);
  }
};

// Precision::fast for integers: positions in fixed point, weights of 15 bits that add up to exactly 1
// (32767), two products and a sum an instruction. Within a plane only; the last interpolation, between
// planes, is in float.
struct PlaneWeights {
  __m512i near, far;  // of the rows; in each the two neighbours along x side by side
  HWY_INLINE PlaneWeights(__m512i x, __m512i row) {
    const __m512i both = _mm512_xor_si512(x, _mm512_set1_epi32(0x7fff));
    far = _mm512_mulhrs_epi16(both, row);
    near = _mm512_sub_epi16(both, far);
  }
  HWY_INLINE __m512 sum(__m512i nearRow, __m512i farRow) const {
    return _mm512_cvtepi32_ps(_mm512_dpwssd_epi32(_mm512_madd_epi16(nearRow, near), farRow, far));
  }
};

HWY_INLINE __m512 betweenPlanes(__m512 near, __m512 far, __m512 scaledFraction) {
  return _mm512_fmadd_ps(scaledFraction, _mm512_mul_ps(_mm512_sub_ps(far, near), _mm512_set1_ps(0x1p-32f)),
                         near);
}

template <class T>
struct FastBlock {
  using Element = T;
  using Places = FixedPlaces;
  static constexpr float kUnit = 1.0f / 32767, kZero = 0;
};

HWY_INLINE __m512 fastInterpolateU8(const CornersU8& corners, const FixedPlaces& at) {
  const __m512i even = _mm512_set1_epi32(0xff00ff);
  const PlaneWeights weights(at.weight(0), at.weight(1));
  const auto plane = [&](__m512i c)
                         HWY_ATTR { return weights.sum(_mm512_and_si512(c, even), _mm512_srli_epi16(c, 8)); };
  return betweenPlanes(plane(corners.near), plane(corners.far), at.scaledFraction(2));
}

struct FastCompactU8 : FastBlock<uint8_t> {
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape& s, const FixedPlaces& at) {
    return fastInterpolateU8(compactCornersU8(base, inAllBytes(at.offsets(s, kBrickStride, 64))), at);
  }
};

struct FastWideU8 : FastBlock<uint8_t> {
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape& s, const FixedPlaces& at) {
    const __m512i index = inAllBytes(at.offsets(s, kBrickStride, 0));
    return fastInterpolateU8(wideCornersU8(base, index, PlaneChoice(at.whole, 2)), at);
  }
};

// Values are made signed for the products, hence the offset.
template <int kPlanes>
struct FastU16 : FastBlock<uint16_t> {
  static constexpr float kZero = -32768.0f * 32767.0f;
  static HWY_INLINE __m512 sample(const uint16_t* base, const BlockShape& s, const FixedPlaces& at) {
    const __m512i index = _mm512_shuffle_epi8(
        at.offsets(s, 8, 0),
        _mm512_set4_epi32(int(0x800c800c), int(0x80088008), int(0x80048004), int(0x80008000)));
    __m512i pairs[4];
    pairsOfU16<kPlanes>(base, s, _mm512_add_epi32(index, _mm512_set1_epi32(0x10000)),
                        PlaneChoice(at.whole, s.planeAxis), pairs);
    const PlaneWeights weights(at.weight(0), at.weight(s.rowAxis));
    const __m512i sign = _mm512_set1_epi32(int(0x80008000));
    const auto plane = [&](const __m512i* rows) HWY_ATTR {
      return weights.sum(_mm512_xor_si512(rows[0], sign), _mm512_xor_si512(rows[1], sign));
    };
    return betweenPlanes(plane(pairs), plane(pairs + 2), at.scaledFraction(s.planeAxis));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
