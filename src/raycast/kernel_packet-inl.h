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
#include "raycast/packet_block-inl.h"
#include "raycast/packet_colours-inl.h"
#include "raycast/packet_walk-inl.h"

#if HWY_TARGET == HWY_AVX3_DL

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// Places in the classification table.
template <class Block>
struct TablePlaces {
  // In the units of Block::sample.
  __m512 firstVisible, lastVisible, zero, scale, lastNode;
  __m512i nothing;
  HWY_INLINE explicit TablePlaces(const KernelScene& scene)
      : firstVisible(sampleOf(scene.firstVisible)),
        lastVisible(sampleOf(scene.lastVisible)),
        zero(sampleOf(scene.rangeLo)),
        scale(_mm512_set1_ps(scene.scale * Block::kUnit)),
        lastNode(_mm512_set1_ps(scene.lastNode)),
        nothing(_mm512_set1_epi32(int32_t(scene.lastNode) + 1)) {}
  static HWY_INLINE __m512 sampleOf(float value) {
    return _mm512_set1_ps(value / Block::kUnit + Block::kZero);
  }

  HWY_INLINE bool visible(__m512 sample) const {
    return (_mm512_cmp_ps_mask(sample, firstVisible, _CMP_GE_OQ) &
            _mm512_cmp_ps_mask(sample, lastVisible, _CMP_LE_OQ)) != 0;
  }
  HWY_INLINE void append(__m512 sample, __mmask16 active, SampleBatch& batch) const {
    __m512 x = _mm512_mul_ps(_mm512_sub_ps(sample, zero), scale);
    x = _mm512_min_ps(_mm512_max_ps(x, _mm512_setzero_ps()), lastNode);
    const __m512i node = _mm512_cvttps_epi32(x);
    _mm512_store_ps(batch.fraction[batch.count], _mm512_sub_ps(x, _mm512_cvtepi32_ps(node)));
    _mm512_store_si512(batch.interval[batch.count],
                       _mm512_slli_epi32(_mm512_mask_blend_epi32(active, nothing, node), 5));
    ++batch.count;
  }
};

// Steps the packet's corner and its lanes through one segment.
template <class Block>
HWY_INLINE void marchPacket(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                            const BlockShape& shape, float* partial, TileCounters& counters) {
  using T = typename Block::Element;
  using Lanes =
      std::conditional_t<std::is_same_v<typename Block::Places, FixedPlaces>, FixedLanes, FloatLanes>;
  const auto* brick = static_cast<const T*>(scene.bricks[segment.cell]);
  const uint64_t windows = scene.windows[segment.cell];
  const PacketEntry entry(scene, rays, segment);
  typename Lanes::Corner corner(entry, segment.kEnd - segment.kBegin);
  Lanes lanes(entry, corner);
  const ActiveLanes activeLanes(rays, segment);
  const TablePlaces<Block> table(scene);
  SampleBatch batch;
  RayColours colours;
  unsigned samples = 0;
  for (int32_t k = segment.kBegin; k < segment.kEnd; ++k, corner.advance(), lanes.advance()) {
    if ((windows >> corner.window() & 1) == 0) continue;
    const __mmask16 active = activeLanes.at(k);
    samples += unsigned(std::popcount(unsigned(active)));
    const __m512 sample = Block::sample(brick + corner.offset(), shape, lanes.places(corner));
    if (!table.visible(sample)) continue;
    table.append(sample, active, batch);
    if (batch.count == kBatch) {
      colours.composite(scene, batch);
      batch.count = 0;
    }
  }
  counters.samples += samples;
  colours.composite(scene, batch);
  colours.store(partial);
}

// The samplers of one element type and precision, by which axes the packet is narrow along.
template <class T, bool kFast>
struct Blocks;
template <bool kFast>
struct Blocks<uint8_t, kFast> {
  using Compact = std::conditional_t<kFast, FastCompactU8, CompactU8>;
  using Wide = std::conditional_t<kFast, FastWideU8, WideU8>;
  static constexpr bool kAnyRow = true;
  static HWY_INLINE void march(bool narrowX, bool narrowPlane, auto&&... arguments) {
    if (narrowX && narrowPlane)
      marchPacket<Compact>(arguments...);
    else
      marchPacket<Wide>(arguments...);
  }
};
template <bool kFast>
struct Blocks<uint16_t, kFast> {
  template <int kPlanes>
  using Packet = std::conditional_t<kFast, FastU16<kPlanes>, PacketU16<kPlanes>>;
  static constexpr bool kAnyRow = false;
  static HWY_INLINE void march(bool, bool narrowPlane, auto&&... arguments) {
    if (narrowPlane)
      marchPacket<Packet<4>>(arguments...);
    else
      marchPacket<Packet<5>>(arguments...);
  }
};
template <bool kFast>
struct Blocks<float, kFast> {
  static constexpr bool kAnyRow = false;
  static HWY_INLINE void march(bool narrowX, bool narrowPlane, auto&&... arguments) {
    if (narrowX && narrowPlane)
      marchPacket<CompactF32>(arguments...);
    else if (narrowPlane)
      marchPacket<WideF32<4>>(arguments...);
    else
      marchPacket<WideF32<5>>(arguments...);
  }
};

template <class T, bool kFast>
HWY_INLINE bool integratePacket(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                float* partial, TileCounters& counters) {
  using Choice = Blocks<T, kFast>;
  const Vec3f spread = spreadWithin(rays, segment);
  const bool narrowX = spread.x < kNarrow, narrowY = spread.y < kNarrow, narrowZ = spread.z < kNarrow;
  if (!Choice::kAnyRow && !narrowY && !narrowZ) return false;
  const bool rowsAlongY = Choice::kAnyRow || narrowY;
  const BlockShape shape = rowsAlongY ? BlockShape{1, 2, kStrideOf[1], kStrideOf[2]}
                                      : BlockShape{2, 1, kStrideOf[2], kStrideOf[1]};
  ++counters.segmentsIntegrated;
  Choice::march(narrowX, narrowY && narrowZ, scene, rays, segment, shape, partial, counters);
  return true;
}

// Integrates by packet where the footprints fit, by the general kernel elsewhere.
template <class T, bool kFast>
struct PacketIntegrator {
  static constexpr RenderMode kMode = RenderMode::dvr;
  static int channels(const KernelScene&) { return 4; }
  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   float* partial, int channelCount, TileCounters& counters) {
    if (rays.packetOwned && integratePacket<T, kFast>(scene, rays, segment, partial, counters)) return;
    GeneralIntegrator<T, Filter::trilinear, RenderMode::dvr, false>::integrate(scene, rays, segment, partial,
                                                                               channelCount, counters);
  }
};

template <class T>
TileKernel selectPrecision(const KernelScene& scene) {
  return scene.fast ? &castTile<PacketIntegrator<T, true>> : &castTile<PacketIntegrator<T, false>>;
}

TileKernel selectPacket(const KernelScene& scene) {
  if (scene.slabs) return nullptr;
  switch (scene.type) {
    case ElementType::u8:
      return selectPrecision<uint8_t>(scene);
    case ElementType::u16:
      return selectPrecision<uint16_t>(scene);
    default:
      return &castTile<PacketIntegrator<float, false>>;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
