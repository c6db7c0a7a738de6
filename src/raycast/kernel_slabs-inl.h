// The general kernel for slabs: any view, lanes clipped by the volume's boundary, packets of any width.
// Included once per instruction set by the kernels.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_KERNEL_SLABS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_KERNEL_SLABS_INL_H_
#undef KAIROS_KERNEL_SLABS_INL_H_
#else
#define KAIROS_KERNEL_SLABS_INL_H_
#endif
// NOLINTEND

#include "raycast/slab_colours-inl.h"

#if HWY_TARGET != HWY_SCALAR

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// Where a segment's slabs end, lane by lane: end i at start + i * slab, in lattice steps from the segment's
// first, clipped to [enter, leave].
struct SlabGeometry {
  HWY_ALIGN float position[3][kLanes];  // of the segment's first lattice point, relative to the brick
  HWY_ALIGN float delta[3][kLanes];
  HWY_ALIGN float start[kLanes], slab[kLanes], enter[kLanes], leave[kLanes];
  HWY_ALIGN float count[kLanes];  // slabs of each lane
  int32_t slabs;                  // of the lane that has most
  bool clipped;                   // does any lane enter or leave the volume within the segment?
};

HWY_INLINE void placeSlabs(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                           SlabGeometry& g) {
  SegmentGeometry lanes;
  placeSegment(scene, rays, segment, lanes);
  const int level = scene.levels[segment.cell] + scene.levelBias;
  const int32_t length = segment.kEnd - segment.kBegin;
  const Vec3i at = cellCoordinates(segment.cell, scene.gridSize);
  for (int a = 0; a < 3; ++a)
    for (int l = 0; l < kLanes; ++l) {
      g.position[a][l] =
          float(rays.origin[a][l] - double(at[a]) * kBrickEdge + double(segment.kBegin) * rays.delta[a][l]);
      g.delta[a][l] = float(rays.delta[a][l]);
    }
  g.slabs = 0;
  g.clipped = false;
  for (int l = 0; l < kLanes; ++l) {
    const bool any = lanes.last[l] > lanes.first[l];
    const int32_t first = rays.packetOwned ? 0 : lanes.first[l],
                  last = rays.packetOwned ? length : lanes.last[l];
    const int32_t slabs = any ? slabCount(last - first, level) : 0;
    g.start[l] = float(any ? first : 0);
    g.count[l] = float(slabs);
    g.slab[l] = any ? float(last - first) / float(slabs) : 0;
    const float enter = float(rays.kBegin[l] - segment.kBegin) + rays.enter[l],
                leave = float(rays.kEnd[l] - segment.kBegin) - rays.leave[l];
    g.enter[l] = !any ? 0 : enter > float(first) ? enter : float(first);
    g.leave[l] = !any ? 0 : leave < float(last) ? leave : float(last);
    if (g.leave[l] < g.enter[l]) g.leave[l] = g.enter[l];
    g.slabs = slabs > g.slabs ? slabs : g.slabs;
    g.clipped = g.clipped || g.enter[l] > 0 || g.leave[l] < float(length);
  }
}

// Which of a segment's slabs may be visible. A packet's lanes stay within the windows at a slab's ends only
// where none of them is clipped.
class SlabWalk {
 public:
  HWY_INLINE SlabWalk(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                      const SlabGeometry& g)
      : windows_(rays.packetOwned && !g.clipped ? scene.windows[segment.cell] : ~uint64_t(0)),
        slab_(g.slab[0]) {
    const Vec3i at = cellCoordinates(segment.cell, scene.gridSize);
    for (int a = 0; a < 3; ++a) {
      start_[a] = float(rays.owner.origin[a] - scene.footprintShift - double(at[a] * kBrickEdge) +
                        double(segment.kBegin) * rays.owner.delta[a]);
      delta_[a] = float(rays.owner.delta[a]);
    }
  }
  HWY_INLINE float at(int32_t end) const { return float(end) * slab_; }
  // First voxel of the packet's footprints at an end, at most `highest` along each axis.
  HWY_INLINE Vec3i corner(int32_t end, const Vec3i& highest) const {
    Vec3i base;
    for (int a = 0; a < 3; ++a) {
      const float p = start_[a] + at(end) * delta_[a];
      base[a] = p > 0 ? (p < float(highest[a]) ? int(p) : highest[a]) : 0;
    }
    return base;
  }
  // The chunk's slabs that may be visible.
  HWY_INLINE uint64_t visible(const SlabChunk& chunk) const {
    if (windows_ == ~uint64_t(0)) return chunk.slabs();
    uint64_t ends = 0;
    for (int32_t i = chunk.begin; i <= chunk.end; ++i) {
      const Vec3i c = corner(chunk.first + i, {kBrickEdge - 1, kBrickEdge - 1, kBrickEdge - 1});
      ends |= (windows_ >> ((c.x >> 2) + (c.y >> 2) * 4 + (c.z >> 2) * 16) & 1) << i;
    }
    return (ends | ends >> 1) & chunk.slabs();
  }

 private:
  uint64_t windows_;
  float slab_;
  float start_[3], delta_[3];
};

// The ends that slabs' values and curvatures are found from.
HWY_INLINE uint64_t endsOf(uint64_t slabs, const SlabChunk& chunk) {
  return (slabs >> 1 | slabs | slabs << 1 | slabs << 2) & chunk.allEnds();
}

// The ends' places in the transfer function, for one part of the packet.
struct SlabPlaces {
  HWY_ALIGN float x[kSlabBatch][kPart];
};

// What kCurvature takes off the places of a chunk's ends (`curvature` of the reference caster).
template <class WidthOf>
class SlabCurvature {
 public:
  // `slab`: a whole slab's width; `count`: each lane's slabs, of which `slabs` is the most.
  HWY_INLINE SlabCurvature(const SlabPlaces& places, const SlabChunk& chunk, int32_t slabs, VF slab, VF count,
                           bool clipped, const WidthOf& widthOf)
      : places_(places),
        first_(chunk.first),
        slabs_(slabs),
        whole_(hn::Mul(slab, set(kWholeSlab))),
        count_(count),
        uniform_(hn::AllTrue(DF(), hn::Eq(count, set(float(slabs))))),
        plain_(uniform_ && !clipped),
        widthOf_(widthOf) {}

  // The corrected place of end i of the chunk.
  HWY_INLINE VF place(int32_t i) const {
    const VF x = hn::Load(DF(), places_.x[i]);
    if (slabs_ < 2) return x;
    const int32_t end = first_ + i, last = slabs_ - 1;
    VF bend = bendAt((end < 1 ? 1 : end > last ? last : end) - first_);
    if (!uniform_ && i > 1) bend = hn::IfThenElse(hn::Ge(set(float(end)), count_), bendAt(i - 1), bend);
    return hn::NegMulAdd(bend, set(kCurvature), x);
  }

 private:
  HWY_INLINE VF bendAt(int32_t i) const {
    const DF d;
    const VF bend = hn::Add(hn::NegMulAdd(set(2), hn::Load(d, places_.x[i]), hn::Load(d, places_.x[i - 1])),
                            hn::Load(d, places_.x[i + 1]));
    if (plain_) return bend;
    return hn::IfThenElseZero(hn::And(hn::Gt(widthOf_(i - 1), whole_), hn::Gt(widthOf_(i), whole_)), bend);
  }

  const SlabPlaces& places_;
  int32_t first_, slabs_;
  VF whole_, count_;
  bool uniform_, plain_;  // plain: every slab is whole
  const WidthOf& widthOf_;
};

// The slabs in the mask, behind what `colours` holds. `widthOf(i)`: the width of slab i of the chunk.
template <class Ends, class WidthOf>
HWY_INLINE void addSlabs(const KernelScene& scene, const Ends& ends, uint64_t visible, const WidthOf& widthOf,
                         SlabColours& colours) {
  const VF first = set((scene.firstVisible - scene.rangeLo) * scene.scale + 1),
           last = set((scene.lastVisible - scene.rangeLo) * scene.scale + 1);
  int32_t placed = -1, found = -1;  // the ends that `behindAt` and `before` are
  VF behindAt = set(0);
  SlabEndRows before;
  for (; visible != 0; visible &= visible - 1) {
    const auto i = int32_t(hwy::Num0BitsBelowLS1Bit_Nonzero64(visible));
    const VF beforeAt = placed == i ? behindAt : ends.place(i);
    behindAt = ends.place(i + 1);
    placed = i + 1;
    const MF outside =
        hn::Or(hn::Lt(hn::Max(beforeAt, behindAt), first), hn::Gt(hn::Min(beforeAt, behindAt), last));
    if (hn::AllTrue(DF(), outside)) continue;
    if (found != i) before = slabEndAt(scene, beforeAt);
    const SlabEndRows behind = slabEndAt(scene, behindAt);
    colours.add(scene, before, behind, widthOf(i));
    before = behind;
    found = i + 1;
  }
}

template <class T>
struct GeneralSlabs {
  static constexpr RenderMode kMode = RenderMode::dvr;
  static int channels(const KernelScene&) { return 4; }

  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   float* partial, int, TileCounters& counters) {
    SlabGeometry g;
    placeSlabs(scene, rays, segment, g);
    integrate(scene, rays, segment, g, partial, counters);
  }

  static HWY_INLINE void integrate(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                                   const SlabGeometry& g, float* partial, TileCounters& counters) {
    const SlabWalk walk(scene, rays, segment, g);
    ++counters.segmentsIntegrated;
    const T* brick = static_cast<const T*>(scene.bricks[segment.cell]);
    for (size_t part = 0; part < kLanes; part += kPart)
      integratePart(scene, brick, g, walk, part, partial + part, counters);
  }

 private:
  static HWY_INLINE void integratePart(const KernelScene& scene, const T* brick, const SlabGeometry& g,
                                       const SlabWalk& walk, size_t part, float* partial,
                                       TileCounters& counters) {
    const DF d;
    const VF start = hn::Load(d, g.start + part), slab = hn::Load(d, g.slab + part),
             enter = hn::Load(d, g.enter + part), leave = hn::Load(d, g.leave + part);
    const auto at = [&](int32_t end) HWY_ATTR {
      return hn::Min(hn::Max(hn::MulAdd(set(float(end)), slab, start), enter), leave);
    };
    const auto along = [&](int a, VF t) HWY_ATTR {
      return hn::MulAdd(t, hn::Load(d, g.delta[a] + part), hn::Load(d, g.position[a] + part));
    };
    const MF inside = hn::Lt(enter, leave);
    SlabColours colours;
    SlabPlaces places;
    for (int32_t slabs = 0; slabs < g.slabs; slabs += kSlabsAtOnce) {
      const SlabChunk chunk(slabs, g.slabs);
      const uint64_t visible = walk.visible(chunk);
      for (uint64_t ends = endsOf(visible, chunk); ends != 0; ends &= ends - 1) {
        const auto i = int32_t(hwy::Num0BitsBelowLS1Bit_Nonzero64(ends));
        const VF t = at(chunk.first + i);
        const Sampler<T, Filter::trilinear> sampler(brick, {along(0, t), along(1, t), along(2, t)}, 0);
        hn::Store(slabPlace(scene, sampler.at(0)), d, places.x[i]);
        counters.samples += hn::CountTrue(
            d, hn::And(inside, hn::Le(set(float(chunk.first + i)), hn::Load(d, g.count + part))));
      }
      const auto widthOf = [&](int32_t i)
                               HWY_ATTR { return hn::Sub(at(chunk.first + i + 1), at(chunk.first + i)); };
      const SlabCurvature<decltype(widthOf)> curvature(places, chunk, g.slabs, slab,
                                                       hn::Load(d, g.count + part), g.clipped, widthOf);
      addSlabs(scene, curvature, visible, widthOf, colours);
    }
    colours.store(partial);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
