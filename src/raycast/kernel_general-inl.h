// Per-target code of the general kernel; included once per instruction set. See kernel_general.cpp.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_KERNEL_GENERAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_KERNEL_GENERAL_INL_H_
#undef KAIROS_KERNEL_GENERAL_INL_H_
#else
#define KAIROS_KERNEL_GENERAL_INL_H_
#endif
// NOLINTEND

#include <cmath>
#include <cstring>

#include "raycast/headlight.h"
#include "raycast/segment_geometry-inl.h"
#include "raycast/tile_kernel.h"

// Highway's one-lane fallback has no blocks to shuffle; a machine without SSE4 takes the scalar caster
// instead.
#if HWY_TARGET != HWY_SCALAR

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The tag of one packet part: all 16 lanes where the target has them, else 8 or 4 at a time.
using DF = hn::CappedTag<float, kLanes>;
using DI = hn::Rebind<int32_t, DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;
constexpr size_t kPart = hn::MaxLanes(DF());
static_assert(kLanes % kPart == 0 && kPart >= 4);

HWY_INLINE VF set(float x) {
  return hn::Set(DF(), x);
}

// Two neighbours along x of every lane.
struct Pairs {
  VF first, second;
};

// Concatenates loads of N floats each into one vector of the tag D, recursively by halves (movq, movhps,
// vinsert...).
template <class D, size_t N, class Load>
HWY_INLINE hn::Vec<D> concatenate(D d, const Load& load, size_t at) {
  if constexpr (hn::MaxLanes(D()) == N) {
    return load(d, at);
  } else {
    const hn::Half<D> half;
    constexpr size_t kHalfLoads = hn::MaxLanes(hn::Half<D>()) / N;
    return hn::Combine(d, concatenate<hn::Half<D>, N>(half, load, at + kHalfLoads),
                       concatenate<hn::Half<D>, N>(half, load, at));
  }
}

HWY_INLINE Pairs loadPairs(const float* voxels, const int32_t* HWY_RESTRICT index) {
  const DF d;
  const auto load = [&](auto d2, size_t lane) HWY_ATTR { return hn::LoadU(d2, voxels + index[lane]); };
  const VF low = concatenate<DF, 2>(d, load, 0), high = concatenate<DF, 2>(d, load, kPart / 2);
  return {hn::ConcatEven(d, high, low), hn::ConcatOdd(d, high, low)};
}

// Four bytes at each lane's voxel: a pair of u16, or a pair of u8 and two more.
template <class T>
HWY_INLINE VI loadWords(const T* voxels, const int32_t* HWY_RESTRICT index) {
  const DI d;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  const VI offset = hn::ShiftLeft < sizeof(T) == 2 ? 1 : 0 > (hn::Load(d, index));
  return hn::GatherOffset(d, reinterpret_cast<const int32_t*>(voxels), offset);
#else
  HWY_ALIGN int32_t words[kPart];
  for (size_t lane = 0; lane < kPart; ++lane)
    std::memcpy(&words[lane], voxels + index[lane], sizeof(int32_t));
  return hn::Load(d, words);
#endif
}

HWY_INLINE Pairs loadPairs(const uint8_t* voxels, const int32_t* HWY_RESTRICT index) {
  const VI words = loadWords(voxels, index), byte = hn::Set(DI(), 0xff);
  return {hn::ConvertTo(DF(), hn::And(words, byte)),
          hn::ConvertTo(DF(), hn::And(hn::ShiftRight<8>(words), byte))};
}

HWY_INLINE Pairs loadPairs(const uint16_t* voxels, const int32_t* HWY_RESTRICT index) {
  const VI words = loadWords(voxels, index), low = hn::Set(DI(), 0xffff);
  return {hn::ConvertTo(DF(), hn::And(words, low)),
          hn::ConvertTo(DF(), hn::And(hn::ShiftRight<16>(words), low))};
}

struct Position {
  VF x, y, z;
};

HWY_INLINE VF lerp(VF a, VF b, VF f) {
  return hn::MulAdd(f, hn::Sub(b, a), a);
}

// Values at (and around) the samples of one packet part. `offset` shifts the footprint by whole voxels.
template <class T, Filter kFilter>
class Sampler {
 public:
  // `local` are positions relative to the brick; `margin` voxels around the footprint must stay inside the
  // brick.
  HWY_INLINE Sampler(const T* brick, const Position& local, float margin) : brick_(brick) {
    constexpr float kHighest = kBrickStride - (kFilter == Filter::trilinear ? 2 : 1);
    const auto corner = [&](VF p) HWY_ATTR {
      const VF rounded = kFilter == Filter::trilinear ? p : hn::Add(p, set(0.5f));
      return hn::Min(hn::Max(hn::Floor(rounded), set(margin)), set(kHighest - margin));
    };
    const VF x = corner(local.x), y = corner(local.y), z = corner(local.z);
    fraction_ = {hn::Sub(local.x, x), hn::Sub(local.y, y), hn::Sub(local.z, z)};
    constexpr float kRow = kBrickStride, kPlane = kBrickStride * kBrickStride;
    hn::Store(hn::ConvertTo(DI(), hn::MulAdd(z, set(kPlane), hn::MulAdd(y, set(kRow), x))), DI(), index_);
  }

  HWY_INLINE VF at(int offset) const {
    const T* p = brick_ + offset;
    if constexpr (kFilter == Filter::nearest) {
      HWY_ALIGN float values[kPart];
      for (size_t lane = 0; lane < kPart; ++lane) values[lane] = float(p[index_[lane]]);
      return hn::Load(DF(), values);
    } else {
      const auto row = [&](int rowOffset) HWY_ATTR {
        const Pairs pairs = loadPairs(p + rowOffset, index_);
        return lerp(pairs.first, pairs.second, fraction_.x);
      };
      constexpr int kPlane = kBrickStride * kBrickStride;
      return lerp(lerp(row(0), row(kBrickStride), fraction_.y),
                  lerp(row(kPlane), row(kPlane + kBrickStride), fraction_.y), fraction_.z);
    }
  }

  // Central differences of the interpolated field over +-1 voxel, in index space. (Equal to interpolating the
  // central differences at the voxels: a shift by whole voxels keeps the weights.)
  HWY_INLINE Position gradient() const {
    constexpr int kPlane = kBrickStride * kBrickStride;
    const auto difference = [&](int offset)
                                HWY_ATTR { return hn::Mul(set(0.5f), hn::Sub(at(offset), at(-offset))); };
    return {difference(1), difference(kBrickStride), difference(kPlane)};
  }

 private:
  const T* brick_;
  Position fraction_;
  HWY_ALIGN int32_t index_[kPart];
};

struct Colour {
  VF r, g, b, a;
};

// Linear interpolation in the table of RGBA nodes: two 16-byte loads a lane, then a 4x4 transpose in every
// block.
HWY_INLINE Colour classify(const KernelScene& scene, VF value) {
  const DF d;
  VF x = hn::Mul(hn::Sub(value, set(scene.rangeLo)), set(scene.scale));
  x = hn::Min(hn::Max(x, hn::Zero(d)), set(scene.lastNode));
  const VI node = hn::ConvertTo(DI(), x);
  const VF f = hn::Sub(x, hn::ConvertTo(d, node));
  HWY_ALIGN int32_t index[kPart];
  hn::Store(hn::ShiftLeft<3>(node), DI(), index);
  const float* table = &scene.intervals[0].at.r;
  // Row m holds the nodes of lanes m, m + 4, m + 8, m + 12, one a block.
  const auto row = [&](size_t m, VF fraction) HWY_ATTR {
    const auto entry = [&](int part) HWY_ATTR {
      const auto load = [&](auto d4, size_t block)
                            HWY_ATTR { return hn::LoadU(d4, table + index[m + 4 * block] + part); };
      return concatenate<DF, 4>(d, load, 0);
    };
    return hn::MulAdd(fraction, entry(4), entry(0));
  };
  const VF row0 = row(0, hn::Broadcast<0>(f)), row1 = row(1, hn::Broadcast<1>(f)),
           row2 = row(2, hn::Broadcast<2>(f)), row3 = row(3, hn::Broadcast<3>(f));
  const hn::Repartition<double, DF> d64;
  const auto pairs = [&](VF a, VF b) HWY_ATTR { return hn::BitCast(d64, hn::InterleaveLower(d, a, b)); };
  const auto pairsUpper = [&](VF a, VF b) HWY_ATTR { return hn::BitCast(d64, hn::InterleaveUpper(d, a, b)); };
  const auto rg0 = pairs(row0, row1), rg1 = pairs(row2, row3), ba0 = pairsUpper(row0, row1),
             ba1 = pairsUpper(row2, row3);
  return {
      hn::BitCast(d, hn::InterleaveLower(d64, rg0, rg1)), hn::BitCast(d, hn::InterleaveUpper(d64, rg0, rg1)),
      hn::BitCast(d, hn::InterleaveLower(d64, ba0, ba1)), hn::BitCast(d, hn::InterleaveUpper(d64, ba0, ba1))};
}

// Headlight shading; see headlight.h for the formula.
HWY_INLINE void shade(const KernelScene& scene, const Position& indexGradient, const Position& direction,
                      Colour& c) {
  const auto& m = scene.worldFromIndexGradient;
  const auto row = [&](int i) HWY_ATTR {
    const VF g =
        hn::MulAdd(set(m[i][0]), indexGradient.x,
                   hn::MulAdd(set(m[i][1]), indexGradient.y, hn::Mul(set(m[i][2]), indexGradient.z)));
    return hn::Min(hn::Max(g, set(-Headlight::kSteepest)), set(Headlight::kSteepest));
  };
  const auto dot3 = [](const Position& a, const Position& b)
                        HWY_ATTR { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); };
  // Rows of the inverse transpose: gradient_world = (index from world)^T gradient_index.
  const Position g{row(0), row(1), row(2)};
  const VF squared = dot3(g, g), guarded = hn::Add(squared, set(scene.flatGradientSquared));
  const VF cosine = hn::Div(hn::Abs(dot3(g, direction)), hn::Sqrt(guarded));
  const VF weight = hn::Div(squared, guarded);
  const VF factor = hn::MulAdd(weight, set(Headlight::kAmbient - 1),
                               hn::MulAdd(set(Headlight::kDiffuse), cosine, set(1.0f)));
  const VF c2 = hn::Mul(cosine, cosine), c4 = hn::Mul(c2, c2), c8 = hn::Mul(c4, c4), c16 = hn::Mul(c8, c8);
  const VF highlight = hn::Mul(hn::Mul(c.a, set(Headlight::kSpecular)), c16);
  c.r = hn::MulAdd(c.r, factor, highlight);
  c.g = hn::MulAdd(c.g, factor, highlight);
  c.b = hn::MulAdd(c.b, factor, highlight);
}

// Accumulates the samples of one packet part. kExtras: shading or depth, decided at run time.
template <class T, Filter kFilter, RenderMode kMode, bool kExtras>
class Accumulator {
 public:
  HWY_INLINE Accumulator(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                         const T* brick, const SegmentGeometry& g, size_t part)
      : scene_(scene), brick_(brick), kBegin_(segment.kBegin) {
    const DF d;
    start_ = {hn::Load(d, g.position[0] + part), hn::Load(d, g.position[1] + part),
              hn::Load(d, g.position[2] + part)};
    delta_ = {hn::Load(d, g.delta[0] + part), hn::Load(d, g.delta[1] + part), hn::Load(d, g.delta[2] + part)};
    first_ = hn::Load(DI(), g.first + part);
    last_ = hn::Load(DI(), g.last + part);
    if constexpr (kExtras)
      direction_ = {hn::LoadU(d, rays.direction[0] + part), hn::LoadU(d, rays.direction[1] + part),
                    hn::LoadU(d, rays.direction[2] + part)};
    const VF zero = hn::Zero(d);
    red_ = kMode == RenderMode::mip ? set(-HUGE_VALF) : zero;
    green_ = blue_ = alpha_ = depth_ = zero;
  }

  template <bool kAllActive>
  HWY_INLINE void sample(int32_t k, TileCounters& counters) {
    const float margin = kExtras && scene_.shade ? 1.0f : 0.0f;
    const Sampler<T, kFilter> sampler(brick_, local(k), margin);
    const VF value = sampler.at(0);
    const MF active = activeAt(k);
    counters.samples += kAllActive ? kPart : hn::CountTrue(DF(), active);
    if constexpr (kMode == RenderMode::mip) {
      red_ = hn::Max(red_, kAllActive ? value : hn::IfThenElse(active, value, set(-HUGE_VALF)));
    } else if constexpr (kMode == RenderMode::average) {
      const VF excess = hn::Sub(value, set(scene_.background));
      red_ = hn::Add(red_, kAllActive ? excess : hn::IfThenElseZero(active, excess));
    } else {
      if (invisible(value)) return;
      Colour c = classify(scene_, value);
      if constexpr (!kAllActive) {
        c.r = hn::IfThenElseZero(active, c.r);
        c.g = hn::IfThenElseZero(active, c.g);
        c.b = hn::IfThenElseZero(active, c.b);
        c.a = hn::IfThenElseZero(active, c.a);
      }
      if constexpr (kExtras) lightAndMeasure(sampler, k, c, counters);
      composite(c);
    }
  }

  // The same for plain dvr, with the samples' values at hand.
  HWY_INLINE void add(VF value, int32_t k, TileCounters& counters) {
    const MF active = activeAt(k);
    counters.samples += hn::CountTrue(DF(), active);
    if (invisible(value)) return;
    const Colour c = classify(scene_, value);
    composite({hn::IfThenElseZero(active, c.r), hn::IfThenElseZero(active, c.g),
               hn::IfThenElseZero(active, c.b), hn::IfThenElseZero(active, c.a)});
  }

  // Positions of sample k relative to the brick.
  HWY_INLINE Position local(int32_t k) const {
    const VF n = set(float(k));
    return {hn::MulAdd(n, delta_.x, start_.x), hn::MulAdd(n, delta_.y, start_.y),
            hn::MulAdd(n, delta_.z, start_.z)};
  }

  HWY_INLINE void store(float* out, int channels) const {
    const DF d;
    hn::StoreU(red_, d, out);
    if (channels == 1) return;
    hn::StoreU(green_, d, out + kLanes);
    hn::StoreU(blue_, d, out + 2 * kLanes);
    hn::StoreU(alpha_, d, out + 3 * kLanes);
    if (channels == 5) hn::StoreU(depth_, d, out + 4 * kLanes);
  }

 private:
  HWY_INLINE MF activeAt(int32_t k) const {
    const VI at = hn::Set(DI(), k);
    return hn::RebindMask(DF(), hn::AndNot(hn::Lt(at, first_), hn::Lt(at, last_)));
  }
  HWY_INLINE bool invisible(VF value) const {
    return hn::AllTrue(
        DF(), hn::Or(hn::Lt(value, set(scene_.firstVisible)), hn::Gt(value, set(scene_.lastVisible))));
  }

  HWY_INLINE void lightAndMeasure(const Sampler<T, kFilter>& sampler, int32_t k, Colour& c,
                                  TileCounters& counters) {
    if (hn::AllTrue(DF(), hn::Eq(c.a, hn::Zero(DF())))) return;
    if (scene_.shade) {
      shade(scene_, sampler.gradient(), direction_, c);
      counters.gradients += kPart;
    }
    if (scene_.depth) {
      const VF distance = set((float(kBegin_ + k) + 0.5f) * scene_.worldStep);
      depth_ = hn::MulAdd(hn::Mul(hn::Sub(set(1.0f), alpha_), c.a), distance, depth_);
    }
  }

  HWY_INLINE void composite(const Colour& c) {
    const VF transmittance = hn::Sub(set(1.0f), alpha_);
    red_ = hn::MulAdd(transmittance, c.r, red_);
    green_ = hn::MulAdd(transmittance, c.g, green_);
    blue_ = hn::MulAdd(transmittance, c.b, blue_);
    alpha_ = hn::MulAdd(transmittance, c.a, alpha_);
  }

  const KernelScene& scene_;
  const T* brick_;
  int32_t kBegin_;
  Position start_, delta_, direction_;
  VI first_, last_;
  VF red_, green_, blue_, alpha_, depth_;
};

template <class T, Filter kFilter, RenderMode kRenderMode, bool kExtras>
struct GeneralIntegrator {
  static constexpr RenderMode kMode = kRenderMode;
  static int channels(const KernelScene& scene) {
    return kMode == RenderMode::dvr ? (kExtras && scene.depth ? 5 : 4) : 1;
  }

  // The partial of one segment: channels x 16 floats. It depends on the segment's own samples only.
  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   float* partial, int channelCount, TileCounters& counters) {
    SegmentGeometry g;
    placeSegment(scene, rays, segment, g);
    const WindowWalk walk(scene, rays, segment);
    ++counters.segmentsIntegrated;
    const T* brick = static_cast<const T*>(scene.bricks[segment.cell]);
    for (size_t part = 0; part < kLanes; part += kPart) {
      Accumulator<T, kFilter, kMode, kExtras> accumulator(scene, rays, segment, brick, g, part);
      int32_t k = 0;
      for (; k < g.allFrom; ++k)
        if (walk.visible(k)) accumulator.template sample<false>(k, counters);
      for (; k < g.allTo; ++k)
        if (walk.visible(k)) accumulator.template sample<true>(k, counters);
      for (; k < g.length; ++k)
        if (walk.visible(k)) accumulator.template sample<false>(k, counters);
      accumulator.store(partial + part, channelCount);
    }
  }
};

// Puts a partial behind the pixels (addBehind of core/compositing.h). True when all rays have ended.
HWY_INLINE bool compositePartial(const KernelScene& scene, const float* partial, float* pixels,
                                 int channels) {
  const DF d;
  bool done = true;
  const VF minimum = set(scene.terminateMinimum), slope = set(scene.terminateSlope);
  for (size_t part = 0; part < kLanes; part += kPart) {
    const auto plane = [&](int c) HWY_ATTR { return size_t(c) * kLanes + part; };
    const VF transmittance = hn::LoadU(d, pixels + plane(channels));
    const VF faded = hn::Mul(slope, hn::Sub(transmittance, minimum));
    const VF weight = hn::Max(hn::Zero(d), hn::Min(transmittance, faded));
    for (int c = 0; c < channels; ++c) {
      const VF front = hn::LoadU(d, pixels + plane(c));
      hn::StoreU(hn::MulAdd(weight, hn::LoadU(d, partial + plane(c)), front), d, pixels + plane(c));
    }
    const VF left = hn::NegMulAdd(transmittance, hn::LoadU(d, partial + plane(3)), transmittance);
    hn::StoreU(left, d, pixels + plane(channels));
    done = done && hn::AllTrue(d, hn::Le(left, minimum));
  }
  return done;
}

template <RenderMode kMode>
HWY_INLINE bool addPartial(const KernelScene& scene, const float* partial, float* pixels, int channels) {
  if constexpr (kMode == RenderMode::dvr) return compositePartial(scene, partial, pixels, channels);
  for (int l = 0; l < kLanes; ++l) {
    if constexpr (kMode == RenderMode::mip)
      pixels[l] = partial[l] > pixels[l] ? partial[l] : pixels[l];
    else
      pixels[l] += partial[l];
  }
  return false;
}

// What a ray shows before its first segment.
template <RenderMode kMode>
HWY_INLINE void clearPixels(float* pixels, int channels) {
  for (int i = 0; i < channels * kLanes; ++i) pixels[i] = 0;
  if constexpr (kMode == RenderMode::dvr)
    for (int l = 0; l < kLanes; ++l) pixels[channels * kLanes + l] = 1;  // transmittance
  if constexpr (kMode == RenderMode::mip)
    for (int l = 0; l < kLanes; ++l) pixels[l] = -HUGE_VALF;
}

// mip: the samples of a skipped segment are all background.
HWY_INLINE void meetBackground(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                               float* pixels) {
  SegmentGeometry g;
  placeSegment(scene, rays, segment, g);
  for (int l = 0; l < kLanes; ++l)
    if (g.first[l] < g.last[l] && pixels[l] < scene.background) pixels[l] = scene.background;
}

// Casts a tile, its segments integrated by Integrator::integrate.
template <class Integrator>
void castTile(const KernelScene& scene, const TileTask& task, TileCounters& counters) {
  constexpr RenderMode kMode = Integrator::kMode;
  const int channels = Integrator::channels(scene);
  const size_t stride = size_t(channels) * kLanes;
  HWY_ALIGN float scratch[5 * kLanes];
  clearPixels<kMode>(task.pixels, channels);
  for (uint32_t s = 0; s < task.segmentCount; ++s) {
    const Segment& segment = task.segments[s];
    if (!scene.visible[segment.cell]) {
      ++counters.segmentsSkipped;
      if constexpr (kMode == RenderMode::mip) meetBackground(scene, *task.rays, segment, task.pixels);
      continue;
    }
    float* partial = task.partials ? task.partials + s * stride : scratch;
    if (task.partials == nullptr || task.stale[s]) {
      Integrator::integrate(scene, *task.rays, segment, partial, channels, counters);
      if (task.partials) task.stale[s] = 0;
    }
    ++counters.segmentsComposited;
    if (addPartial<kMode>(scene, partial, task.pixels, channels)) break;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
