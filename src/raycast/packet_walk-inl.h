// A packet's way through one segment: its lanes, and the low corner of their footprints.
// Included by kernel_packet-inl.h.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_PACKET_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_PACKET_WALK_INL_H_
#undef KAIROS_PACKET_WALK_INL_H_
#else
#define KAIROS_PACKET_WALK_INL_H_
#endif
// NOLINTEND

#include <cmath>
#include <cstdint>

#include "raycast/packet_block-inl.h"
#include "raycast/tile_kernel.h"

#if HWY_TARGET == HWY_AVX3_DL

#include <immintrin.h>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// Where a packet enters a segment: its lanes and the low corner of their footprints (the owner), in voxels
// from the brick's first.
struct PacketEntry {
  __m512d start[3][2], delta[3][2];
  double ownerStart[3], ownerDelta[3];

  HWY_INLINE PacketEntry(const KernelScene& scene, const TileRays& rays, const Segment& segment) {
    const Vec3i at = cellCoordinates(segment.cell, scene.gridSize);
    const double t = segment.kBegin + 0.5;
    for (int a = 0; a < 3; ++a) {
      const double base = double(at[a] * kBrickEdge);
      for (int half = 0; half < 2; ++half) {
        delta[a][half] = _mm512_loadu_pd(rays.delta[a] + 8 * half);
        start[a][half] =
            _mm512_fmadd_pd(_mm512_set1_pd(t), delta[a][half],
                            _mm512_sub_pd(_mm512_loadu_pd(rays.origin[a] + 8 * half), _mm512_set1_pd(base)));
      }
      ownerDelta[a] = rays.owner.delta[a];
      ownerStart[a] = std::fma(t, ownerDelta[a], rays.owner.origin[a] - base);
    }
  }
};

// The low corner of the packet's footprints, sample by sample, in fixed point: `kBits` behind the point.
// Truncating a fixed-point number is exact, so all that follows from the corner (the block, the window)
// agrees.
template <class Int, int kBits>
class CornerWalk {
 public:
  HWY_INLINE CornerWalk(const PacketEntry& entry, int32_t length) {
    for (int a = 0; a < 3; ++a) {
      at_[a] = fixed(entry.ownerStart[a]);
      delta_[a] = fixed(entry.ownerDelta[a]);
      // The segment's samples lie in the brick but for rounding, which must not lead out of it.
      const Int end = at_[a] + (length - 1) * delta_[a];
      const Int low = at_[a] < end ? at_[a] : end, high = at_[a] < end ? end : at_[a];
      constexpr Int kHighest = (Int(kBrickEdge) << kBits) - 1;
      shift_[a] = low < 0 ? -low : high > kHighest ? kHighest - high : 0;
      at_[a] += shift_[a];
    }
  }
  HWY_INLINE void advance() {
    for (int a = 0; a < 3; ++a) at_[a] += delta_[a];
  }
  HWY_INLINE int corner(int axis) const { return int(at_[axis] >> kBits); }
  HWY_INLINE int offset() const {
    return corner(0) + corner(1) * kBrickStride + corner(2) * (kBrickStride * kBrickStride);
  }
  /// The bit of the window that footprints starting here read.
  HWY_INLINE int window() const {
    return int(at_[0] >> (kBits + 2)) + int(at_[1] >> (kBits + 2)) * 4 + int(at_[2] >> (kBits + 2)) * 16;
  }
  HWY_INLINE Int shift(int axis) const { return shift_[axis]; }

  static constexpr double kOne = double(uint64_t(1) << kBits);

 private:
  static HWY_INLINE Int fixed(double v) { return Int(_mm_cvtsd_si64(_mm_set_sd(v * kOne))); }
  Int at_[3], delta_[3], shift_[3];
};

// The lanes of a packet, walking along with its corner.
struct FloatLanes {
  using Corner = CornerWalk<int64_t, 32>;
  __m512 start[3], delta[3], n = _mm512_setzero_ps();

  HWY_INLINE FloatLanes(const PacketEntry& entry, const Corner&) {
    const auto joined = [](const __m512d* halves) HWY_ATTR {
      return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(halves[0])),
                                _mm512_cvtpd_ps(halves[1]), 1);
    };
    for (int a = 0; a < 3; ++a) {
      start[a] = joined(entry.start[a]);
      delta[a] = joined(entry.delta[a]);
    }
  }
  HWY_INLINE void advance() { n = _mm512_add_ps(n, _mm512_set1_ps(1)); }
  HWY_INLINE FloatPlaces places(const Corner& corner) const {
    FloatPlaces p;
    for (int a = 0; a < 3; ++a) {
      const __m512 local =
          _mm512_sub_ps(_mm512_fmadd_ps(n, delta[a], start[a]), _mm512_set1_ps(float(corner.corner(a))));
      p.whole[a] = _mm512_roundscale_ps(local, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
      p.fraction[a] = _mm512_sub_ps(local, p.whole[a]);
    }
    return p;
  }
};

struct FixedLanes {
  // The same arithmetic for lanes and corner: no lane can fall below it.
  using Corner = CornerWalk<int32_t, 24>;
  __m512i at[3], delta[3];

  HWY_INLINE FixedLanes(const PacketEntry& entry, const Corner& corner) {
    const auto joined = [](const __m512d* halves) HWY_ATTR {
      const auto fixed = [](__m512d v) HWY_ATTR {
        return _mm512_cvtpd_epi32(_mm512_mul_pd(v, _mm512_set1_pd(Corner::kOne)));
      };
      return _mm512_inserti64x4(_mm512_castsi256_si512(fixed(halves[0])), fixed(halves[1]), 1);
    };
    for (int a = 0; a < 3; ++a) {
      at[a] = _mm512_add_epi32(joined(entry.start[a]), _mm512_set1_epi32(corner.shift(a)));
      delta[a] = joined(entry.delta[a]);
    }
  }
  HWY_INLINE void advance() {
    for (int a = 0; a < 3; ++a) at[a] = _mm512_add_epi32(at[a], delta[a]);
  }
  HWY_INLINE FixedPlaces places(const Corner& corner) const {
    const int bytes = corner.corner(0) | corner.corner(1) << 8 | corner.corner(2) << 16;
    const __m512i whole =
        _mm512_shldi_epi32(_mm512_shldi_epi32(_mm512_srli_epi32(at[2], 24), at[1], 8), at[0], 8);
    return {{at[0], at[1], at[2]}, _mm512_sub_epi8(whole, _mm512_set1_epi32(bytes))};
  }
};

// Which lanes have a sample at index k.
struct ActiveLanes {
  __m512i begin, end;
  bool always;
  HWY_INLINE ActiveLanes(const TileRays& rays, const Segment& segment)
      : begin(_mm512_loadu_si512(rays.kBegin)), end(_mm512_loadu_si512(rays.kEnd)) {
    always = (_mm512_cmple_epi32_mask(begin, _mm512_set1_epi32(segment.kBegin)) &
              _mm512_cmpge_epi32_mask(end, _mm512_set1_epi32(segment.kEnd))) == 0xffff;
  }
  HWY_INLINE __mmask16 at(int32_t k) const {
    if (always) return 0xffff;
    const __m512i kk = _mm512_set1_epi32(k);
    return _mm512_cmple_epi32_mask(begin, kk) & _mm512_cmpgt_epi32_mask(end, kk);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
