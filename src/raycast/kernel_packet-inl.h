// Per-target code of the packet kernel; included once per instruction set. See kernel_packet.cpp.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_KERNEL_PACKET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_KERNEL_PACKET_INL_H_
#undef KAIROS_KERNEL_PACKET_INL_H_
#else
#define KAIROS_KERNEL_PACKET_INL_H_
#endif
// NOLINTEND

#include "raycast/kernel_general-inl.h"

#if HWY_TARGET == HWY_AVX3_DL

#include <immintrin.h>

#include <bit>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// All 16 footprints of a packet at one sample lie in a block of a few voxels: it is fetched by plain loads
// into registers, and every lane's corners are picked from there by permutes. A block is `planes` planes of
// rows along x. The row and plane axes are y and z, or z and y: the row axis must be the one along which the
// packet is less than two voxels wide.
struct BlockShape {
  int rowAxis, planeAxis;
  int rowStride, planeStride;
};

constexpr int kStrideOf[3] = {1, kBrickStride, kBrickStride* kBrickStride};

// Positions of the 16 lanes at one sample, relative to the block's base corner: whole part and fraction.
struct LanePositions {
  __m512 whole[3], fraction[3];
};

HWY_INLINE __m512 lerp(__m512 a, __m512 b, __m512 f) {
  return _mm512_fmadd_ps(f, _mm512_sub_ps(b, a), a);
}

// Eight corners to a value: c[z][y][x] in the order (row, plane) of the block's axes.
HWY_INLINE __m512 interpolate(const __m512 (&c)[8], __m512 fx, __m512 fRow, __m512 fPlane) {
  return lerp(lerp(lerp(c[0], c[1], fx), lerp(c[2], c[3], fx), fRow),
              lerp(lerp(c[4], c[5], fx), lerp(c[6], c[7], fx), fRow), fPlane);
}

HWY_INLINE __m512 fourRows(const float* p, int stride) {
  __m512 v = _mm512_castps128_ps512(_mm_loadu_ps(p));
  v = _mm512_insertf32x4(v, _mm_loadu_ps(p + stride), 1);
  v = _mm512_insertf32x4(v, _mm_loadu_ps(p + 2 * stride), 2);
  return _mm512_insertf32x4(v, _mm_loadu_ps(p + 3 * stride), 3);
}

// f32, packets less than two voxels wide on every axis: 4^3 voxels in four registers.
struct CompactF32 {
  using Element = float;
  static HWY_INLINE __m512 sample(const float* base, const BlockShape& s, const LanePositions& at) {
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

// Which of a block's planes each lane's sample starts in, as masks for choosing among the planes' candidates.
struct PlaneChoice {
  __mmask16 one, two, three;
  HWY_INLINE explicit PlaneChoice(__m512 whole)
      : one(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(1), _CMP_GE_OQ)),
        two(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(2), _CMP_GE_OQ)),
        three(_mm512_cmp_ps_mask(whole, _mm512_set1_ps(3), _CMP_GE_OQ)) {}
  // candidates[0..3] hold what a lane finds when it starts in that plane.
  template <int kPlanes>
  HWY_INLINE __m512i choose(const __m512i* candidates) const {
    __m512i v = _mm512_mask_mov_epi32(candidates[0], one, candidates[1]);
    v = _mm512_mask_mov_epi32(v, two, candidates[2]);
    if constexpr (kPlanes == 5) v = _mm512_mask_mov_epi32(v, three, candidates[3]);
    return v;
  }
};

// f32, packets up to six voxels wide along x: rows of eight, four rows a plane.
template <int kPlanes>
struct WideF32 {
  using Element = float;
  static HWY_INLINE __m512 sample(const float* base, const BlockShape& s, const LanePositions& at) {
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

HWY_INLINE __m512 toFloat(__m512i v) {
  return _mm512_cvtepi32_ps(v);
}

// u16: rows of eight, four rows in one register a plane; a permute finds both neighbours along x at once.
template <int kPlanes>
struct PacketU16 {
  using Element = uint16_t;
  static HWY_INLINE __m512 sample(const uint16_t* base, const BlockShape& s, const LanePositions& at) {
    __m512i index = _mm512_cvttps_epi32(_mm512_fmadd_ps(at.whole[s.rowAxis], _mm512_set1_ps(8), at.whole[0]));
    index =
        _mm512_add_epi32(_mm512_or_si512(index, _mm512_slli_epi32(index, 16)), _mm512_set1_epi32(0x10000));
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
    const PlaneChoice choice(at.whole[s.planeAxis]);
    const __m512i low = _mm512_set1_epi32(0xffff);
    __m512 c[8];
    for (int i = 0; i < 4; ++i) {
      const __m512i pair = choice.choose<kPlanes>(found[i & 1] + (i >> 1));
      c[2 * i] = toFloat(_mm512_and_si512(pair, low));
      c[2 * i + 1] = toFloat(_mm512_srli_epi32(pair, 16));
    }
    return interpolate(c, at.fraction[0], at.fraction[s.rowAxis], at.fraction[s.planeAxis]);
  }
};

// u8: whole planes by loads of 64 bytes; a permute finds the four corners of a plane at once, one a byte:
// (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1).
struct CornersU8 {
  static HWY_INLINE __m512i indices(const LanePositions& at, float planeSpan) {
    const __m512 index =
        _mm512_fmadd_ps(at.whole[2], _mm512_set1_ps(planeSpan),
                        _mm512_fmadd_ps(at.whole[1], _mm512_set1_ps(kBrickStride), at.whole[0]));
    const __m512i bytes = _mm512_mullo_epi32(_mm512_cvttps_epi32(index), _mm512_set1_epi32(0x01010101));
    constexpr int kCornerOffsets = (kBrickStride + 1) << 24 | kBrickStride << 16 | 1 << 8;
    return _mm512_add_epi8(bytes, _mm512_set1_epi32(kCornerOffsets));
  }
  static HWY_INLINE __m512 value(__m512i near, __m512i far, const LanePositions& at) {
    const __m512i byte = _mm512_set1_epi32(0xff);
    const auto corner = [&](__m512i v, auto shift)
                            HWY_ATTR { return toFloat(_mm512_and_si512(_mm512_srli_epi32(v, shift), byte)); };
    const __m512 c[8] = {corner(near, 0), corner(near, 8), corner(near, 16), corner(near, 24),
                         corner(far, 0),  corner(far, 8),  corner(far, 16),  corner(far, 24)};
    return interpolate(c, at.fraction[0], at.fraction[1], at.fraction[2]);
  }
};

struct CompactU8 {
  using Element = uint8_t;
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape&, const LanePositions& at) {
    constexpr int kPlane = kBrickStride * kBrickStride;
    const __m512i p0 = _mm512_loadu_si512(base), p1 = _mm512_loadu_si512(base + kPlane),
                  p2 = _mm512_loadu_si512(base + 2 * kPlane), p3 = _mm512_loadu_si512(base + 3 * kPlane);
    const __m512i near = CornersU8::indices(at, 64), far = _mm512_add_epi8(near, _mm512_set1_epi8(64));
    const auto pick = [&](__m512i i) HWY_ATTR {
      return _mm512_mask_blend_epi8(_mm512_movepi8_mask(i), _mm512_permutex2var_epi8(p0, i, p1),
                                    _mm512_permutex2var_epi8(p2, i, p3));
    };
    return CornersU8::value(pick(near), pick(far), at);
  }
};

struct WideU8 {
  using Element = uint8_t;
  static HWY_INLINE __m512 sample(const uint8_t* base, const BlockShape&, const LanePositions& at) {
    const __m512i index = CornersU8::indices(at, 0);
    __m512i found[5];
    for (int p = 0; p < 5; ++p) {
      const uint8_t* plane = base + p * kBrickStride * kBrickStride;
      found[p] = _mm512_permutex2var_epi8(_mm512_loadu_si512(plane), index, _mm512_loadu_si512(plane + 64));
    }
    const PlaneChoice choice(at.whole[2]);
    return CornersU8::value(choice.choose<5>(found), choice.choose<5>(found + 1), at);
  }
};

// Samples of a segment that may be visible, waiting for classification: byte offsets of their intervals and
// the place within, 16 lanes each.
constexpr int kBatch = 32;
struct SampleBatch {
  alignas(64) int32_t interval[kBatch][kLanes];
  alignas(64) float fraction[kBatch][kLanes];
  int count = 0;
};

// Four rays' RGBA side by side in each register, and their transmittance in every channel.
struct RayColours {
  __m512 colour[4], transmittance[4];
  HWY_INLINE RayColours() {
    for (int g = 0; g < 4; ++g) {
      colour[g] = _mm512_setzero_ps();
      transmittance[g] = _mm512_set1_ps(1);
    }
  }

  HWY_INLINE void composite(const KernelScene& scene, const SampleBatch& batch) {
    const char* table = reinterpret_cast<const char*>(scene.intervals);
    const __m512i spread[4] = {spreadOf(0), spreadOf(4), spreadOf(8), spreadOf(12)};
    for (int n = 0; n < batch.count; ++n) {
      const __m512 fractions = _mm512_load_ps(batch.fraction[n]);
      const int32_t* interval = batch.interval[n];
      for (int g = 0; g < 4; ++g) {
        const auto two = [&](int lane) HWY_ATTR {
          const auto entry = [&](int l) HWY_ATTR {
            return _mm256_load_ps(reinterpret_cast<const float*>(table + interval[l]));
          };
          return _mm512_insertf32x8(_mm512_castps256_ps512(entry(lane)), entry(lane + 1), 1);
        };
        const __m512 first = two(4 * g), second = two(4 * g + 2);
        const __m512 at = _mm512_shuffle_f32x4(first, second, 0x88),
                     slope = _mm512_shuffle_f32x4(first, second, 0xdd);
        const __m512 c = _mm512_fmadd_ps(_mm512_permutexvar_ps(spread[g], fractions), slope, at);
        const __m512 alpha = _mm512_permute_ps(c, 0xff);
        colour[g] = _mm512_fmadd_ps(transmittance[g], c, colour[g]);
        transmittance[g] = _mm512_fnmadd_ps(transmittance[g], alpha, transmittance[g]);
      }
    }
  }

  // To the partial's four planes of 16 lanes.
  HWY_INLINE void store(float* partial) const {
    alignas(64) float rays[kLanes][4];
    for (int g = 0; g < 4; ++g) _mm512_store_ps(rays[4 * g], colour[g]);
    const __m512i lane = _mm512_mullo_epi32(
        _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0), _mm512_set1_epi32(4));
    for (int c = 0; c < 4; ++c)
      _mm512_storeu_ps(partial + c * kLanes, _mm512_i32gather_ps(lane, &rays[0][c], 4));
  }

 private:
  static HWY_INLINE __m512i spreadOf(int l) {
    return _mm512_set_epi32(l + 3, l + 3, l + 3, l + 3, l + 2, l + 2, l + 2, l + 2, l + 1, l + 1, l + 1,
                            l + 1, l, l, l, l);
  }
};

// Steps the packet's base corner and its lanes through one segment.
template <class Block>
HWY_INLINE void marchPacket(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                            const SegmentGeometry& g, const BlockShape& shape, RayColours& out,
                            TileCounters& counters) {
  using T = typename Block::Element;
  const auto* brick = static_cast<const T*>(scene.bricks[segment.cell]);
  __m512 start[3], delta[3];
  const WindowWalk walk(scene, rays, segment);
  for (int a = 0; a < 3; ++a) {
    start[a] = _mm512_load_ps(g.position[a]);
    delta[a] = _mm512_load_ps(g.delta[a]);
  }
  const __m512i first = _mm512_load_si512(g.first), last = _mm512_load_si512(g.last);
  const __m512 lo = _mm512_set1_ps(scene.rangeLo), scale = _mm512_set1_ps(scene.scale),
               lastNode = _mm512_set1_ps(scene.lastNode);
  const __m512 firstVisible = _mm512_set1_ps(scene.firstVisible),
               lastVisible = _mm512_set1_ps(scene.lastVisible);
  const __m512i nothing = _mm512_set1_epi32(int32_t(scene.lastNode) + 1);
  SampleBatch batch;
  for (int32_t k = 0; k < g.length; ++k) {
    const Vec3i corner = walk.corner(k);
    if (!walk.visible(corner)) continue;
    const __m512i kk = _mm512_set1_epi32(k);
    const __mmask16 active = _mm512_cmple_epi32_mask(first, kk) & _mm512_cmpgt_epi32_mask(last, kk);
    counters.samples += unsigned(std::popcount(unsigned(active)));
    const __m512 n = _mm512_set1_ps(float(k));
    LanePositions where;
    int offset = 0;
    for (int a = 0; a < 3; ++a) {
      offset += corner[a] * kStrideOf[a];
      const __m512 local =
          _mm512_sub_ps(_mm512_fmadd_ps(n, delta[a], start[a]), _mm512_set1_ps(float(corner[a])));
      where.whole[a] = _mm512_roundscale_ps(local, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
      where.fraction[a] = _mm512_sub_ps(local, where.whole[a]);
    }
    const __m512 value = Block::sample(brick + offset, shape, where);
    const __mmask16 visible = _mm512_cmp_ps_mask(value, firstVisible, _CMP_GE_OQ) &
                              _mm512_cmp_ps_mask(value, lastVisible, _CMP_LE_OQ);
    if (visible == 0) continue;
    __m512 x = _mm512_mul_ps(_mm512_sub_ps(value, lo), scale);
    x = _mm512_min_ps(_mm512_max_ps(x, _mm512_setzero_ps()), lastNode);
    __m512i node = _mm512_cvttps_epi32(x);
    _mm512_store_ps(batch.fraction[batch.count], _mm512_sub_ps(x, _mm512_cvtepi32_ps(node)));
    node = _mm512_mask_blend_epi32(active, nothing, node);
    _mm512_store_si512(batch.interval[batch.count], _mm512_slli_epi32(node, 5));
    if (++batch.count == kBatch) {
      out.composite(scene, batch);
      batch.count = 0;
    }
  }
  out.composite(scene, batch);
}

// Widest spread of the packet's lanes within a segment, per axis, in voxels.
HWY_INLINE Vec3f spreadWithin(const TileRays& rays, const Segment& segment) {
  Vec3f spread;
  for (int a = 0; a < 3; ++a)
    spread[a] = float(rays.spread[a] + (segment.kEnd - 0.5) * rays.spreadDelta[a]) + 2e-3f;
  return spread;
}

constexpr float kNarrow = 2;  // voxels a packet may spread over for its footprints to fit four voxels

template <class T>
HWY_INLINE bool integratePacket(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                float* partial, TileCounters& counters) {
  const Vec3f spread = spreadWithin(rays, segment);
  const bool narrowX = spread.x < kNarrow, narrowY = spread.y < kNarrow, narrowZ = spread.z < kNarrow;
  if constexpr (!std::is_same_v<T, uint8_t>)
    if (!narrowY && !narrowZ) return false;
  const BlockShape shape =
      narrowY ? BlockShape{1, 2, kStrideOf[1], kStrideOf[2]} : BlockShape{2, 1, kStrideOf[2], kStrideOf[1]};
  SegmentGeometry g;
  placeSegment(scene, rays, segment, g);
  ++counters.segmentsIntegrated;
  RayColours colours;
  const bool narrowPlane = narrowY && narrowZ;
  if constexpr (std::is_same_v<T, uint8_t>) {
    if (narrowX && narrowPlane)
      marchPacket<CompactU8>(scene, rays, segment, g, shape, colours, counters);
    else
      marchPacket<WideU8>(scene, rays, segment, g, shape, colours, counters);
  } else if constexpr (std::is_same_v<T, uint16_t>) {
    if (narrowPlane)
      marchPacket<PacketU16<4>>(scene, rays, segment, g, shape, colours, counters);
    else
      marchPacket<PacketU16<5>>(scene, rays, segment, g, shape, colours, counters);
  } else {
    if (narrowX && narrowPlane)
      marchPacket<CompactF32>(scene, rays, segment, g, shape, colours, counters);
    else if (narrowPlane)
      marchPacket<WideF32<4>>(scene, rays, segment, g, shape, colours, counters);
    else
      marchPacket<WideF32<5>>(scene, rays, segment, g, shape, colours, counters);
  }
  colours.store(partial);
  return true;
}

// Integrates by packet where the footprints fit, by the general kernel elsewhere.
template <class T>
struct PacketIntegrator {
  static constexpr RenderMode kMode = RenderMode::dvr;
  static int channels(const KernelScene&) { return 4; }
  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   float* partial, int channelCount, TileCounters& counters) {
    if (rays.packetOwned && integratePacket<T>(scene, rays, segment, partial, counters)) return;
    GeneralIntegrator<T, Filter::trilinear, RenderMode::dvr, false>::integrate(scene, rays, segment, partial,
                                                                               channelCount, counters);
  }
};

TileKernel selectPacket(const KernelScene& scene) {
  if (scene.mode != RenderMode::dvr || scene.filter != Filter::trilinear || scene.shade || scene.depth)
    return nullptr;
  switch (scene.type) {
    case ElementType::u8:
      return &castTile<PacketIntegrator<uint8_t>>;
    case ElementType::u16:
      return &castTile<PacketIntegrator<uint16_t>>;
    default:
      return &castTile<PacketIntegrator<float>>;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
