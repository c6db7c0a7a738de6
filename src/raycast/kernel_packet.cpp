// The packet kernel: a 4x4 packet's whole neighbourhood in registers, where its rays lie close enough
// together. AVX-512 with VBMI (Ice Lake, Zen 4 and later); elsewhere the general kernel does all.
#include "raycast/tile_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "raycast/kernel_packet.cpp"
#define HWY_WANT_AVX3_DL 1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX2 | HWY_AVX3)
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

#if HWY_ONCE

namespace kairos {

TileKernel packetKernel(const KernelScene& scene, Isa isa) {
#if HWY_TARGETS & HWY_AVX3_DL
  if ((isa == Isa::automatic || isa == Isa::avx512) && (hwy::SupportedTargets() & HWY_AVX3_DL) != 0)
    return N_AVX3_DL::selectPacket(scene);
#endif
  return nullptr;
}

}  // namespace kairos

#endif  // HWY_ONCE
