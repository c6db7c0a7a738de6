// Per-target code of the packet kernel where permutes reach 16 bytes: AVX2 and AVX-512
// without VBMI for u8 and u16, SSE4 for u8; included once per instruction set. See kernel_packet.cpp.
//
// The voxels that all 16 footprints of a packet can read at one sample are loaded once, as planes of four
// rows of eight; every lane's corners are picked from there by byte shuffles. (f32 would need eight look-ups
// a corner: the general kernel's pair loads are cheaper.)

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_KERNEL_SHUFFLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_KERNEL_SHUFFLE_INL_H_
#undef KAIROS_KERNEL_SHUFFLE_INL_H_
#else
#define KAIROS_KERNEL_SHUFFLE_INL_H_
#endif
// NOLINTEND

#include <array>
#include <type_traits>
#include <utility>

#include "raycast/kernel_general-inl.h"

#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_AVX3_DL

#include <emmintrin.h>

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

using DB = hn::Repartition<uint8_t, DF>;
using VB = hn::Vec<DB>;

// The row axis is the one along which the packet is less than two voxels wide, so that four rows serve all
// lanes.
struct ShuffleShape {
  int rowAxis, planeAxis, rowStride, planeStride;
};

// Where each lane's footprint starts in the block (whole parts) and how far beyond (fractions).
struct ShufflePlaces {
  VF x, row, plane, fractionX, fractionRow, fractionPlane;

  HWY_INLINE ShufflePlaces(const Position& local, const Vec3i& corner, const ShuffleShape& s) {
    const auto split = [](VF p, int base, VF& whole, VF& fraction) HWY_ATTR {
      const VF relative = hn::Sub(p, set(float(base)));
      whole = hn::Trunc(relative);
      fraction = hn::Sub(relative, whole);
    };
    const bool rowsAlongY = s.rowAxis == 1;
    split(local.x, corner.x, x, fractionX);
    split(rowsAlongY ? local.y : local.z, corner[s.rowAxis], row, fractionRow);
    split(rowsAlongY ? local.z : local.y, corner[s.planeAxis], plane, fractionPlane);
  }
};

// candidates[i] is what a lane finds when it starts at i.
template <int kCandidates>
HWY_INLINE VI chooseByStart(const VI* candidates, VF start) {
  VI v = candidates[0];
  for (int i = 1; i < kCandidates; ++i)
    v = hn::IfThenElse(hn::RebindMask(DI(), hn::Ge(start, set(float(i)))), candidates[i], v);
  return v;
}

HWY_INLINE VI lookUp(VB table, VI bytes) {
  return hn::BitCast(DI(), hn::TableLookupBytes(table, hn::BitCast(DB(), bytes)));
}

// 16 bytes from one place, or 8 from each of two, in every block.
HWY_INLINE VB loadTable(const uint16_t* row) {
  return hn::LoadDup128(DB(), reinterpret_cast<const uint8_t*>(row));
}
HWY_INLINE VB loadTable(const uint8_t* first, const uint8_t* second) {
  const __m128i low = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)),
                high = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(second));
  HWY_ALIGN uint8_t both[16];
  _mm_store_si128(reinterpret_cast<__m128i*>(both), _mm_unpacklo_epi64(low, high));
  return hn::LoadDup128(DB(), both);
}

// The block of voxels around one sample of the packet, for one element type.
template <class T, int kPlanes>
class ShuffleBlock;

template <int kPlanes>
class ShuffleBlock<uint8_t, kPlanes> {
 public:
  HWY_INLINE ShuffleBlock(const uint8_t* base, const ShuffleShape& s) {
    for (int p = 0; p < kPlanes; ++p) {
      const uint8_t* plane = base + p * s.planeStride;
      low_[p] = loadTable(plane, plane + s.rowStride);
      high_[p] = loadTable(plane + 2 * s.rowStride, plane + 3 * s.rowStride);
    }
  }
  // Corners (x, row), (x + 1, row), (x, row + 1), (x + 1, row + 1) of the near plane, then of the far one.
  HWY_INLINE void corners(const ShufflePlaces& at, VF* c) const {
    const VI offset = hn::ConvertTo(DI(), hn::MulAdd(at.row, set(8), at.x));
    const VI pairs = hn::Or(offset, hn::ShiftLeft<8>(offset));
    const VI all = hn::Add(hn::Or(pairs, hn::ShiftLeft<16>(pairs)), hn::Set(DI(), 0x09080100));
    // A byte look-up gives 0 where the index has its highest bit: each table answers for its own half only.
    const VI inLow = hn::Add(all, hn::Set(DI(), 0x70707070));
    const VI inHigh = hn::Xor(all, hn::Set(DI(), 0x10101010));
    const VI high = hn::Or(inHigh, hn::ShiftLeft<3>(hn::And(inHigh, hn::Set(DI(), 0x10101010))));
    VI found[kPlanes];
    for (int p = 0; p < kPlanes; ++p) found[p] = hn::Or(lookUp(low_[p], inLow), lookUp(high_[p], high));
    const VI byte = hn::Set(DI(), 0xff);
    for (int side = 0; side < 2; ++side) {
      const VI v = chooseByStart<kPlanes - 1>(found + side, at.plane);
      c[4 * side] = hn::ConvertTo(DF(), hn::And(v, byte));
      c[4 * side + 1] = hn::ConvertTo(DF(), hn::And(hn::ShiftRight<8>(v), byte));
      c[4 * side + 2] = hn::ConvertTo(DF(), hn::And(hn::ShiftRight<16>(v), byte));
      c[4 * side + 3] = hn::ConvertTo(DF(), hn::And(hn::ShiftRight<24>(v), byte));
    }
  }

 private:
  VB low_[kPlanes], high_[kPlanes];
};

template <int kPlanes>
class ShuffleBlock<uint16_t, kPlanes> {
 public:
  HWY_INLINE ShuffleBlock(const uint16_t* base, const ShuffleShape& s) {
    for (int p = 0; p < kPlanes; ++p)
      for (int r = 0; r < 4; ++r) rows_[p][r] = loadTable(base + p * s.planeStride + r * s.rowStride);
  }
  HWY_INLINE void corners(const ShufflePlaces& at, VF* c) const {
    const VI twice = hn::ConvertTo(DI(), hn::Add(at.x, at.x));
    const VI pairs = hn::Or(twice, hn::ShiftLeft<8>(twice));
    const VI bytes = hn::Add(hn::Or(pairs, hn::ShiftLeft<16>(pairs)), hn::Set(DI(), 0x03020100));
    VI found[2][kPlanes];  // of the near row and of the far one
    for (int p = 0; p < kPlanes; ++p) {
      VI row[4];
      for (int r = 0; r < 4; ++r) row[r] = lookUp(rows_[p][r], bytes);
      found[0][p] = chooseByStart<3>(row, at.row);
      found[1][p] = chooseByStart<3>(row + 1, at.row);
    }
    const VI low = hn::Set(DI(), 0xffff);
    for (int i = 0; i < 4; ++i) {
      const VI v = chooseByStart<kPlanes - 1>(found[i & 1] + (i >> 1), at.plane);
      c[2 * i] = hn::ConvertTo(DF(), hn::And(v, low));
      c[2 * i + 1] = hn::ConvertTo(DF(), hn::And(hn::ShiftRight<16>(v), low));
    }
  }

 private:
  VB rows_[kPlanes][4];
};

template <class T>
struct ShuffleIntegrator {
  static constexpr RenderMode kMode = RenderMode::dvr;
  using Part = Accumulator<T, Filter::trilinear, RenderMode::dvr, false>;
  static int channels(const KernelScene&) { return 4; }

  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   float* partial, int channelCount, TileCounters& counters) {
    const Vec3f spread = spreadWithin(rays, segment);
    const bool narrowY = spread.y < kNarrow, narrowZ = spread.z < kNarrow;
    if (!rays.packetOwned || (!narrowY && !narrowZ))
      return GeneralIntegrator<T, Filter::trilinear, RenderMode::dvr, false>::integrate(
          scene, rays, segment, partial, channelCount, counters);
    ++counters.segmentsIntegrated;
    constexpr int kRow = kBrickStride, kPlane = kBrickStride * kBrickStride;
    const ShuffleShape shape = narrowY ? ShuffleShape{1, 2, kRow, kPlane} : ShuffleShape{2, 1, kPlane, kRow};
    if (narrowY && narrowZ)
      march<4>(scene, rays, segment, shape, partial, counters);
    else
      march<5>(scene, rays, segment, shape, partial, counters);
  }

 private:
  template <int kPlanes>
  static HWY_INLINE void march(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                               const ShuffleShape& shape, float* partial, TileCounters& counters) {
    const auto* brick = static_cast<const T*>(scene.bricks[segment.cell]);
    SegmentGeometry g;
    placeSegment(scene, rays, segment, g);
    const WindowWalk walk(scene, rays, segment);
    auto parts = [&]<size_t... i>(std::index_sequence<i...>) HWY_ATTR {
      return std::array<Part, sizeof...(i)>{Part(scene, rays, segment, brick, g, i * kPart)...};
    }
    (std::make_index_sequence<kLanes / kPart>());
    for (int32_t k = 0; k < g.length; ++k) {
      const Vec3i corner = walk.corner(k);
      if (!walk.visible(corner)) continue;
      const ShuffleBlock<T, kPlanes> block(
          brick + corner.x + corner.y * kBrickStride + corner.z * (kBrickStride * kBrickStride), shape);
      for (Part& part : parts) {
        const ShufflePlaces at(part.local(k), corner, shape);
        VF c[8];
        block.corners(at, c);
        const auto plane = [&](int first) HWY_ATTR {
          return lerp(lerp(c[first], c[first + 1], at.fractionX),
                      lerp(c[first + 2], c[first + 3], at.fractionX), at.fractionRow);
        };
        part.add(lerp(plane(0), plane(4), at.fractionPlane), k, counters);
      }
    }
    for (size_t i = 0; i < parts.size(); ++i) parts[i].store(partial + i * kPart, 4);
  }
};

TileKernel selectShuffle(const KernelScene& scene) {
  if (scene.slabs) return nullptr;
  if (scene.type == ElementType::u8) return &castTile<ShuffleIntegrator<uint8_t>>;
  // Four lanes at a time, u16's many look-ups take longer than the general kernel's loads.
  if constexpr (kPart >= 8)
    if (scene.type == ElementType::u16) return &castTile<ShuffleIntegrator<uint16_t>>;
  return nullptr;
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
