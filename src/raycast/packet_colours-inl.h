// Second pass of the packet kernel: samples to colours. Included by kernel_packet-inl.h.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_PACKET_COLOURS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_PACKET_COLOURS_INL_H_
#undef KAIROS_PACKET_COLOURS_INL_H_
#else
#define KAIROS_PACKET_COLOURS_INL_H_
#endif
// NOLINTEND

#include <cstdint>

#include "raycast/tile_kernel.h"

#if HWY_TARGET == HWY_AVX3_DL

#include <immintrin.h>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// Samples of a segment that may be visible, waiting for classification: byte offsets of their intervals and
// the place within, 16 lanes each.
constexpr int kBatch = 32;
struct SampleBatch {
  alignas(64) int32_t interval[kBatch][kLanes];
  alignas(64) float fraction[kBatch][kLanes];
  int count = 0;
};

// Four rays' RGBA side by side in each register (register g: rays g, 4 + g, 8 + g, 12 + g), and their
// transmittance in every channel.
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
    for (int n = 0; n < batch.count; ++n) {
      const __m512 fractions = _mm512_load_ps(batch.fraction[n]);
      add<0>(table, batch.interval[n], fractions);
      add<1>(table, batch.interval[n], fractions);
      add<2>(table, batch.interval[n], fractions);
      add<3>(table, batch.interval[n], fractions);
    }
  }

  // To the partial's four planes of 16 lanes: a 4x4 transpose in every block of 128 bits.
  HWY_INLINE void store(float* partial) const {
    const auto pairs = [](__m512 a, __m512 b) HWY_ATTR { return _mm512_castps_pd(_mm512_unpacklo_ps(a, b)); };
    const auto pairsUpper = [](__m512 a, __m512 b)
                                HWY_ATTR { return _mm512_castps_pd(_mm512_unpackhi_ps(a, b)); };
    const __m512d rg0 = pairs(colour[0], colour[1]), rg1 = pairs(colour[2], colour[3]),
                  ba0 = pairsUpper(colour[0], colour[1]), ba1 = pairsUpper(colour[2], colour[3]);
    const auto plane = [&](int c, __m512d v)
                           HWY_ATTR { _mm512_storeu_ps(partial + c * kLanes, _mm512_castpd_ps(v)); };
    plane(0, _mm512_unpacklo_pd(rg0, rg1));
    plane(1, _mm512_unpackhi_pd(rg0, rg1));
    plane(2, _mm512_unpacklo_pd(ba0, ba1));
    plane(3, _mm512_unpackhi_pd(ba0, ba1));
  }

 private:
  template <int g>
  HWY_INLINE void add(const char* table, const int32_t* interval, __m512 fractions) {
    const auto entry = [&](int ray) HWY_ATTR {
      return _mm256_load_ps(reinterpret_cast<const float*>(table + interval[ray]));
    };
    const auto two = [&](int ray) HWY_ATTR {
      return _mm512_insertf32x8(_mm512_castps256_ps512(entry(ray)), entry(ray + 4), 1);
    };
    const __m512 first = two(g), second = two(g + 8);
    const __m512 at = _mm512_shuffle_f32x4(first, second, 0x88),
                 slope = _mm512_shuffle_f32x4(first, second, 0xdd);
    const __m512 c = _mm512_fmadd_ps(_mm512_permute_ps(fractions, g * 0x55), slope, at);
    colour[g] = _mm512_fmadd_ps(transmittance[g], c, colour[g]);
    transmittance[g] = _mm512_fnmadd_ps(transmittance[g], _mm512_permute_ps(c, 0xff), transmittance[g]);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
