// Compiled once per instruction set by Highway's foreach_target.
#include "io/half_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "io/half_rows.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// foreach_target comes first by Highway's rules
#include <hwy/highway.h>

#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The other targets have no instructions that convert to and from halves.
#undef KAIROS_CONVERTS_HALVES
#define KAIROS_CONVERTS_HALVES (HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3)

void halvesOf(const float* values, size_t count, half* out) {
  size_t i = 0;
#if KAIROS_CONVERTS_HALVES
  const hn::ScalableTag<float> d;
  const hn::Rebind<hwy::float16_t, decltype(d)> dh;
  static_assert(sizeof(half) == sizeof(hwy::float16_t));
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d))
    hn::StoreU(hn::DemoteTo(dh, hn::LoadU(d, values + i)), dh, reinterpret_cast<hwy::float16_t*>(out + i));
#endif
  for (; i < count; ++i) out[i] = half(values[i]);
}

void floatsOf(const char* halves, size_t count, float* out) {
  size_t i = 0;
#if KAIROS_CONVERTS_HALVES
  const hn::ScalableTag<float> d;
  const hn::Rebind<hwy::float16_t, decltype(d)> dh;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d))
    hn::StoreU(hn::PromoteTo(d, hn::LoadU(dh, reinterpret_cast<const hwy::float16_t*>(halves) + i)), d,
               out + i);
#endif
  for (; i < count; ++i) {
    half h;
    std::memcpy(&h, halves + i * sizeof(half), sizeof(half));
    out[i] = float(h);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace kairos {
namespace {

HWY_EXPORT(halvesOf);
HWY_EXPORT(floatsOf);

}  // namespace

void toHalves(const float* values, size_t count, half* out) {
  HWY_DYNAMIC_DISPATCH(halvesOf)(values, count, out);
}
void toFloats(const char* halves, size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(floatsOf)(halves, count, out);
}

}  // namespace kairos

#endif  // HWY_ONCE
