// Where a segment's samples lie in its brick; included once per instruction set by the kernels.

// NOLINTBEGIN(llvm-header-guard): Highway's toggling guard
#if defined(KAIROS_SEGMENT_GEOMETRY_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KAIROS_SEGMENT_GEOMETRY_INL_H_
#undef KAIROS_SEGMENT_GEOMETRY_INL_H_
#else
#define KAIROS_SEGMENT_GEOMETRY_INL_H_
#endif
// NOLINTEND

#include <cmath>

#include "raycast/tile_kernel.h"

#if HWY_TARGET != HWY_SCALAR

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

// One segment of one tile, ready to be integrated: where its rays run relative to the brick, and each lane's
// samples.
struct SegmentGeometry {
  HWY_ALIGN float position[3][kLanes];  // of sample kBegin
  HWY_ALIGN float delta[3][kLanes];
  HWY_ALIGN int32_t first[kLanes], last[kLanes];  // relative to kBegin, last exclusive
  int32_t length;                                 // samples of the longest lane
  int32_t allFrom, allTo;                         // within these all lanes are active
};

HWY_INLINE double crossing(double plane, double origin, double delta) {
  // The same arithmetic as firstSampleBeyond, in a form that vectorises.
  const double inverse = 1.0 / (delta == 0 ? 1e-300 : delta);
  const double k = (plane - origin) * inverse - 0.5;
  const double index = delta < 0 ? std::floor(k) + 1 : std::ceil(k);
  constexpr double kLimit = 1 << 30;
  return index < -kLimit ? -kLimit : index > kLimit ? kLimit : index;
}

HWY_INLINE void placeSegment(const KernelScene& scene, const TileRays& rays, const Segment& segment,
                             SegmentGeometry& g) {
  const Vec3i at = cellCoordinates(segment.cell, scene.gridSize);
  HWY_ALIGN double from[kLanes], to[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    from[l] = rays.kBegin[l] > segment.kBegin ? rays.kBegin[l] : segment.kBegin;
    to[l] = rays.kEnd[l] < segment.kEnd ? rays.kEnd[l] : segment.kEnd;
  }
  for (int a = 0; a < 3; ++a) {
    const double base = double(at[a]) * kBrickEdge;
    for (int l = 0; l < kLanes; ++l) {
      g.position[a][l] = float(rays.origin[a][l] - base + (segment.kBegin + 0.5) * rays.delta[a][l]);
      g.delta[a][l] = float(rays.delta[a][l]);
    }
    if (rays.packetOwned) continue;
    for (int l = 0; l < kLanes; ++l) {
      const double origin = rays.origin[a][l] + scene.footprintShift, delta = rays.delta[a][l];
      const double enter = crossing(delta < 0 ? base + kBrickEdge : base, origin, delta);
      const double leave = crossing(delta < 0 ? base : base + kBrickEdge, origin, delta);
      from[l] = from[l] > enter ? from[l] : enter;
      to[l] = to[l] < leave ? to[l] : leave;
    }
  }
  int32_t shortest = segment.kEnd, longest = 0, latest = 0;
  for (int l = 0; l < kLanes; ++l) {
    const int32_t first = int32_t(from[l]) - segment.kBegin, last = int32_t(to[l]) - segment.kBegin;
    const bool any = last > first;
    g.first[l] = any ? first : 0;
    g.last[l] = any ? last : 0;
    latest = g.first[l] > latest ? g.first[l] : latest;
    shortest = g.last[l] < shortest ? g.last[l] : shortest;
    longest = g.last[l] > longest ? g.last[l] : longest;
  }
  g.length = longest;
  g.allFrom = latest < shortest ? latest : longest;
  g.allTo = latest < shortest ? shortest : longest;
}

// Widest spread of the packet's lanes within a segment, per axis, in voxels.
HWY_INLINE Vec3f spreadWithin(const TileRays& rays, const Segment& segment) {
  Vec3f spread;
  for (int a = 0; a < 3; ++a)
    spread[a] = float(rays.spread[a] + (segment.kEnd - 0.5) * rays.spreadDelta[a]) + 2e-3f;
  return spread;
}

constexpr float kNarrow = 2;  // voxels a packet may spread over for its footprints to fit four voxels

// The low corner of a packet's footprints along a segment, and whether anything it can read is visible there.
class WindowWalk {
 public:
  HWY_INLINE WindowWalk(const KernelScene& scene, const TileRays& rays, const Segment& segment)
      : visible_(rays.packetOwned ? scene.windows[segment.cell] : ~uint64_t(0)) {
    const Vec3i at = cellCoordinates(segment.cell, scene.gridSize);
    for (int a = 0; a < 3; ++a) {
      start_[a] = float(rays.owner.origin[a] - double(at[a] * kBrickEdge) +
                        (segment.kBegin + 0.5) * rays.owner.delta[a]);
      delta_[a] = float(rays.owner.delta[a]);
    }
  }
  // First voxel of the packet's footprints at sample k (from the segment's first), relative to the brick.
  HWY_INLINE Vec3i corner(int32_t k) const {
    Vec3i base;
    for (int a = 0; a < 3; ++a) {
      const float p = start_[a] + float(k) * delta_[a];
      base[a] = p > 0 ? (p < kBrickEdge - 1 ? int(p) : kBrickEdge - 1) : 0;
    }
    return base;
  }
  HWY_INLINE bool visible(const Vec3i& corner) const {
    return visible_ >> ((corner.x >> 2) + (corner.y >> 2) * 4 + (corner.z >> 2) * 16) & 1;
  }
  HWY_INLINE bool allVisible() const { return visible_ == ~uint64_t(0); }
  HWY_INLINE bool visible(int32_t k) const { return allVisible() || visible(corner(k)); }

 private:
  uint64_t visible_;
  float start_[3], delta_[3];
};

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET
#endif  // include guard
