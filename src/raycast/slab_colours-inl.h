// Slabs to colours: the transfer function's integrals between a slab's two end values, and the slabs of a
// segment behind each other. Included once per instruction set by the kernels.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_SLAB_COLOURS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_SLAB_COLOURS_INL_H_
#undef KAIROS_SLAB_COLOURS_INL_H_
#else
#define KAIROS_SLAB_COLOURS_INL_H_
#endif
// NOLINTEND

#include "raycast/kernel_general-inl.h"
#include "raycast/slab_levels.h"

#if HWY_TARGET != HWY_SCALAR

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// 1 - exp(-depth), to float precision relative to itself; depth >= 0.
HWY_INLINE VF opacityOfDepth(VF depth) {
  const DF d;
  const VF x = hn::Neg(hn::Min(depth, set(60)));
  const VF k = hn::Round(hn::Mul(x, set(1.44269504f)));
  const VF r = hn::NegMulAdd(k, set(-1.42860677e-6f), hn::NegMulAdd(k, set(0.693148613f), x));
  VF p = set(1.0f / 5040);
  for (const float c : {1.0f / 720, 1.0f / 120, 1.0f / 24, 1.0f / 6, 0.5f, 1.0f})
    p = hn::MulAdd(p, r, set(c));
  p = hn::Mul(p, r);
  const VI exponent = hn::Add(hn::ConvertTo(DI(), k), hn::Set(DI(), 127));
  const VF power = hn::BitCast(d, hn::ShiftLeft<23>(exponent));
  return hn::Sub(hn::Sub(set(1), power), hn::Mul(power, p));
}

// Four lanes' RGBA side by side in each vector: row m has lanes m, m + 4, m + 8... , one a block.
struct SlabRows {
  VF row[4];
};

// Broadcasts, for each row, its lanes' values over their four channels.
template <int m>
HWY_INLINE VF ofRow(VF lanes) {
  return hn::Broadcast<m>(lanes);
}

// Lane values of one channel of the rows; the inverse of ofRow.
template <int kChannel>
HWY_INLINE VF channelOf(const SlabRows& rows) {
  const DF d;
  const VI place = hn::And(hn::Iota(DI(), 0), hn::Set(DI(), 3));
  const auto at = [&](int m) HWY_ATTR { return hn::RebindMask(d, hn::Eq(place, hn::Set(DI(), m))); };
  VF v = hn::Broadcast<kChannel>(rows.row[0]);
  v = hn::IfThenElse(at(1), hn::Broadcast<kChannel>(rows.row[1]), v);
  v = hn::IfThenElse(at(2), hn::Broadcast<kChannel>(rows.row[2]), v);
  return hn::IfThenElse(at(3), hn::Broadcast<kChannel>(rows.row[3]), v);
}

// One end of a slab among the transfer function's densities (SlabEnd of scalar_sampling.h).
struct SlabEndRows {
  VF x;
  VI interval;
  VF density[4], within[4];  // within: the integral from the interval's start
  VI integral[4];
};

// Where a value stands: its node coordinate + 1.
HWY_INLINE VF slabPlace(const KernelScene& scene, VF value) {
  const VF x = hn::MulAdd(hn::Sub(value, set(scene.rangeLo)), set(scene.scale), set(1));
  return hn::Min(hn::Max(x, set(-0x1p20f)), set(0x1p20f));
}

HWY_INLINE SlabEndRows slabEndAt(const KernelScene& scene, VF x) {
  const DF d;
  SlabEndRows end;
  end.x = x;
  end.interval = hn::ConvertTo(DI(), hn::Min(hn::Max(x, hn::Zero(d)), set(scene.lastNode + 1)));
  const VF f = hn::Sub(x, hn::ConvertTo(d, end.interval));
  HWY_ALIGN int32_t offset[kPart];
  hn::Store(hn::ShiftLeft<4>(end.interval), DI(), offset);
  const float* table = &scene.densities[0].at.r;
  const auto row = [&](size_t m, VF fraction) HWY_ATTR {
    const auto entry = [&](int part) HWY_ATTR {
      const auto load = [&](auto d4, size_t block)
                            HWY_ATTR { return hn::LoadU(d4, table + offset[m + 4 * block] + part); };
      return concatenate<DF, 4>(d, load, 0);
    };
    const VF at = entry(0);
    end.density[m] = hn::MulAdd(fraction, entry(4), at);
    end.within[m] = hn::Mul(hn::Mul(set(0.5f), fraction), hn::Add(at, end.density[m]));
    end.integral[m] = hn::BitCast(DI(), entry(8));
  };
  row(0, hn::Broadcast<0>(f));
  row(1, hn::Broadcast<1>(f));
  row(2, hn::Broadcast<2>(f));
  row(3, hn::Broadcast<3>(f));
  return end;
}

// Four lanes' colours in each row, and their transmittance in every channel.
class SlabColours {
 public:
  HWY_INLINE SlabColours() {
    for (int m = 0; m < 4; ++m) {
      colour_.row[m] = hn::Zero(DF());
      transmittance_[m] = set(1);
    }
  }

  // Puts the slab from `a` to `b` behind; `width` in lattice steps.
  HWY_INLINE void add(const KernelScene& scene, const SlabEndRows& a, const SlabEndRows& b, VF width) {
    const DF d;
    const VF reach = hn::Sub(b.x, a.x);
    const MF straight = hn::Or(hn::RebindMask(d, hn::Eq(a.interval, b.interval)),
                               hn::Lt(hn::Abs(reach), set(kShortestReach)));
    const VF flags = hn::VecFromMask(d, straight);
    SlabRows sum;
    sum.row[0] = mean<0>(scene, a, b, flags);
    sum.row[1] = mean<1>(scene, a, b, flags);
    sum.row[2] = mean<2>(scene, a, b, flags);
    sum.row[3] = mean<3>(scene, a, b, flags);
    const VF total = channelOf<3>(sum);
    const VF depth =
        hn::Max(hn::Zero(d), hn::Div(hn::Mul(total, width), hn::IfThenElse(straight, set(1), reach)));
    const VF share =
        hn::IfThenElse(hn::Gt(depth, hn::Zero(d)), hn::Div(opacityOfDepth(depth), total), hn::Zero(d));
    composite<0>(sum, share);
    composite<1>(sum, share);
    composite<2>(sum, share);
    composite<3>(sum, share);
  }

  // To the partial's four planes.
  HWY_INLINE void store(float* out) const {
    const DF d;
    hn::StoreU(channelOf<0>(colour_), d, out);
    hn::StoreU(channelOf<1>(colour_), d, out + kLanes);
    hn::StoreU(channelOf<2>(colour_), d, out + 2 * kLanes);
    hn::StoreU(channelOf<3>(colour_), d, out + 3 * kLanes);
  }

 private:
  template <int m>
  static HWY_INLINE VF mean(const KernelScene& scene, const SlabEndRows& a, const SlabEndRows& b, VF flags) {
    const DF d;
    const VF whole = hn::ConvertTo(d, hn::Sub(b.integral[m], a.integral[m]));
    const VF bent = hn::MulAdd(whole, set(scene.integralUnit), hn::Sub(b.within[m], a.within[m]));
    const VF straight = hn::Mul(set(0.5f), hn::Add(a.density[m], b.density[m]));
    return hn::IfThenElse(hn::MaskFromVec(ofRow<m>(flags)), straight, bent);
  }
  template <int m>
  HWY_INLINE void composite(const SlabRows& sum, VF share) {
    const VF c = hn::Mul(sum.row[m], ofRow<m>(share));
    colour_.row[m] = hn::MulAdd(transmittance_[m], c, colour_.row[m]);
    transmittance_[m] = hn::NegMulAdd(transmittance_[m], hn::Broadcast<3>(c), transmittance_[m]);
  }

  SlabRows colour_;
  VF transmittance_[4];
};

// Up to so many ends are sampled before their slabs are integrated.
constexpr int kSlabBatch = 64;
constexpr int kSlabsAtOnce = kSlabBatch - 3;

// Bit i of a mask stands for end `first + i` of a segment, or the slab from there to the next.
struct SlabChunk {
  int32_t first, ends;  // the ends that its slabs' values and curvatures need
  int32_t begin, end;   // its slabs, relative to `first`
  HWY_INLINE SlabChunk(int32_t slab, int32_t slabs) {
    first = slab > 0 ? slab - 1 : 0;
    const int32_t stop = slab + kSlabsAtOnce < slabs ? slab + kSlabsAtOnce : slabs;
    ends = (stop < slabs ? stop + 2 : slabs + 1) - first;
    begin = slab - first;
    end = stop - first;
  }
  HWY_INLINE uint64_t slabs() const { return (~uint64_t(0) >> (64 - (end - begin))) << begin; }
  HWY_INLINE uint64_t allEnds() const { return ~uint64_t(0) >> (64 - ends); }
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
