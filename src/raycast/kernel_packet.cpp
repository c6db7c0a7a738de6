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
