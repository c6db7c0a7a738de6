// The packet kernels: a 4x4 packet's whole neighbourhood in registers, where its rays lie close enough
// together; elsewhere the general kernel. With VBMI (Ice Lake, Zen 4 and later) for all element types, with
// 16-byte shuffles for u8 and u16.
#include "raycast/tile_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "raycast/kernel_packet.cpp"
#define HWY_WANT_AVX3_DL 1
#ifdef KAIROS_AVX2_ALONE
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_AVX3_DL)
#else
#define HWY_DISABLED_TARGETS HWY_SSSE3
#endif
#include <hwy/foreach_target.h>
// foreach_target comes first by Highway's rules
#include <hwy/highway.h>

// Highway 1.0 requires AVX512-VNNI of this target, but asks the compiler for AVX-VNNI in its place. (Which
// stays, or Highway's own functions could not be inlined.)
#if HWY_TARGET == HWY_AVX3_DL && defined(HWY_TARGET_STR)
#undef HWY_TARGET_STR
#define HWY_TARGET_STR \
  HWY_TARGET_STR_AVX3  \
  ",vpclmulqdq,avx512vbmi,avx512vbmi2,vaes,avxvnni,avx512vnni,avx512bitalg,avx512vpopcntdq"
#endif

#include "raycast/kernel_packet-inl.h"
#include "raycast/kernel_shuffle-inl.h"

#if HWY_ONCE

#include "raycast/kernel_targets.h"

namespace kairos {
namespace {

// Best first.
constexpr KernelTarget kTargets[] = {
#if HWY_TARGETS & HWY_AVX3_DL
    {Isa::avx512, HWY_AVX3_DL, &N_AVX3_DL::selectPacket},
#endif
#if HWY_TARGETS & HWY_AVX3
    {Isa::avx512, HWY_AVX3, &N_AVX3::selectShuffle},
#endif
#if HWY_TARGETS & HWY_AVX2
    {Isa::avx2, HWY_AVX2, &N_AVX2::selectShuffle},
#endif
#if HWY_TARGETS & HWY_SSE4
    {Isa::sse4, HWY_SSE4, &N_SSE4::selectShuffle},
#endif
    {Isa::scalar, 0, nullptr},  // where no other is compiled
};

}  // namespace

TileKernel packetKernel(const KernelScene& scene, Isa isa) {
  if (scene.mode != RenderMode::dvr || scene.filter != Filter::trilinear || scene.shade || scene.depth)
    return nullptr;
  const KernelTarget* target = findTarget(kTargets, isa);
  return target ? target->select(scene) : nullptr;
}

}  // namespace kairos

#endif  // HWY_ONCE
