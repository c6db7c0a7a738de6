#include "raycast/tile_rays.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace kairos {
namespace {

constexpr double kMaxIndex = 1 << 30;

// Slopes below this are none: their inverse would overflow.
constexpr double kParallel = 1e-250;

int32_t toIndex(double k) {
  return int32_t(std::clamp(k, -kMaxIndex, kMaxIndex));
}

// The part of a ray, in sample distances from its origin, that lies inside boxes; empty where leave < enter.
struct Inside {
  double enter = 0, leave = kMaxIndex;

  // Narrows it to lo <= origin + t * delta <= hi.
  void clip(double lo, double hi, double origin, double delta) {
    if (delta == 0) {
      if (origin < lo || origin > hi) leave = -1;
      return;
    }
    double in = (lo - origin) / delta, out = (hi - origin) / delta;
    if (in > out) std::swap(in, out);
    enter = std::max(enter, in);
    leave = std::min(leave, out);
  }
};

}  // namespace

int32_t firstSampleBeyond(double plane, double origin, double delta) {
  const double inverse = 1.0 / (delta == 0 ? 1e-300 : delta);
  const double k = (plane - origin) * inverse - 0.5;
  return toIndex(delta < 0 ? std::floor(k) + 1 : std::ceil(k));
}

int32_t TileSampling::firstSample() const {
  int32_t k = int32_t(kMaxIndex);
  for (int l = 0; l < kLanes; ++l)
    if (kBegin[l] < kEnd[l]) k = std::min(k, kBegin[l]);
  return k;
}

int32_t TileSampling::lastSample() const {
  int32_t k = 0;
  for (int l = 0; l < kLanes; ++l)
    if (kBegin[l] < kEnd[l]) k = std::max(k, kEnd[l]);
  return k;
}

ViewRays::ViewRays(const RenderSettings& settings, const Lattice& lattice, const Vec3i& gridOrigin,
                   const RayLattice& rays)
    : generator_(settings.camera, settings.width, settings.height),
      rays_(rays),
      width_(rays.columns > 0 ? rays.columns : settings.width),
      height_(rays.rows > 0 ? rays.rows : settings.height),
      tilesX_((width_ + kTileEdge - 1) / kTileEdge),
      tilesY_((height_ + kTileEdge - 1) / kTileEdge),
      worldStep_(settings.worldStep(lattice)),
      perspective_(settings.camera.projection == Camera::Projection::perspective),
      shift_(settings.footprintShift()),
      footprintWidth_(settings.footprintWidth()),
      footprintExtent_(settings.footprintExtent()),
      sampleStride_(settings.slabs() ? std::max(1, int(0.5 / settings.latticeStep())) : 1),
      slabs_(settings.slabs()),
      shaded_(settings.shade),
      samplingBox_(lattice.samplingBox()),
      clipped_(settings.clipBox.has_value()),
      clipBox_(settings.clipBox.value_or(PointBox{})) {
  const Vec3d origin(gridOrigin);
  const Affine indexFromWorld = lattice.worldFromIndex.inverse();
  samplingBox_.lo = samplingBox_.lo - origin;
  samplingBox_.hi = samplingBox_.hi - origin;
  // The difference first: far from the world's origin, two large products would leave their rounding.
  eye_ = indexFromWorld.vector(settings.camera.eye - lattice.worldFromIndex.translation) - origin;
  right_ = indexFromWorld.vector(generator_.right());
  down_ = -indexFromWorld.vector(generator_.up());
  forward_ = indexFromWorld.vector(generator_.forward());
  const PointBox world = lattice.worldBounds();
  const double farthest =
      length(settings.camera.eye - (world.lo + world.hi) * 0.5) + length(world.hi - world.lo);
  if (!(farthest / worldStep_ < kMaxIndex / 2))
    throw OptionError("--eye", "the camera is " + std::to_string(farthest / worldStep_) +
                                   " sample distances away from the volume, expected fewer than 5e8");
}

void ViewRays::geometry(int tile, TileRays& rays) const {
  const int x0 = tile % tilesX_ * kTileEdge, y0 = tile / tilesX_ * kTileEdge;
  double x[kLanes], y[kLanes], scale[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    x[l] = generator_.offsetX(imageX(x0 + l % kTileEdge));
    y[l] = generator_.offsetY(imageY(y0 + l / kTileEdge));
    // The image axes are orthonormal, so the direction's length before normalisation is known.
    scale[l] = perspective_ ? worldStep_ / std::sqrt(1 + x[l] * x[l] + y[l] * y[l]) : worldStep_;
  }
  for (int a = 0; a < 3; ++a) {
    const double right = right_[a], down = down_[a], forward = forward_[a], eye = eye_[a];
    for (int l = 0; l < kLanes; ++l) {
      const double offset = right * x[l] + down * y[l];
      rays.origin[a][l] = perspective_ ? eye : eye + offset;
      const double delta = (perspective_ ? forward + offset : forward) * scale[l];
      rays.delta[a][l] = std::abs(delta) < kParallel ? 0 : delta;
    }
  }
  if (!shaded_) return;
  for (int l = 0; l < kLanes; ++l) {
    const Ray ray = generator_.ray(imageX(x0 + l % kTileEdge), imageY(y0 + l / kTileEdge));
    for (int a = 0; a < 3; ++a) rays.direction[a][l] = float(ray.direction[a]);
  }
}

TileRays ViewRays::rays(int tile) const {
  TileRays rays;
  geometry(tile, rays);
  findSampleRanges(tile, rays);
  decideOwnership(rays);
  return rays;
}

void ViewRays::findSampleRanges(int tile, TileRays& rays) const {
  const int x0 = tile % tilesX_ * kTileEdge, y0 = tile / tilesX_ * kTileEdge;
  for (int l = 0; l < kLanes; ++l) {
    const int x = x0 + l % kTileEdge, y = y0 + l / kTileEdge;
    Inside inside;
    if (x >= width_ || y >= height_) inside.leave = -1;
    for (int a = 0; a < 3; ++a)
      inside.clip(samplingBox_.lo[a], samplingBox_.hi[a], rays.origin[a][l], rays.delta[a][l]);
    if (clipped_ && inside.enter <= inside.leave) {
      const Ray ray = generator_.ray(imageX(x), imageY(y));
      for (int a = 0; a < 3; ++a)
        inside.clip(clipBox_.lo[a], clipBox_.hi[a], ray.origin[a], ray.direction[a] * worldStep_);
    }
    takeSamples(inside.enter, inside.leave, l, rays);
  }
}

// The samples within [enter, leave]; of slabs, those with a share of their interval of the lattice in it.
void ViewRays::takeSamples(double enter, double leave, int lane, TileRays& rays) const {
  const double first = slabs_ ? std::floor(enter) : std::ceil(enter - 0.5),
               end = slabs_ ? std::ceil(leave) : std::floor(leave - 0.5) + 1;
  rays.kBegin[lane] = toIndex(first);
  rays.kEnd[lane] = enter <= leave ? std::max(rays.kBegin[lane], toIndex(end)) : rays.kBegin[lane];
  rays.enter[lane] = slabs_ ? float(enter - first) : 0;
  rays.leave[lane] = slabs_ ? float(end - leave) : 0;
}

void ViewRays::decideOwnership(TileRays& rays) const {
  // The smallest corner of all lanes at sample k is itself a ray: lanes share their origin (perspective) or
  // their direction (orthographic), and k + 0.5 > 0.
  Vec3d widest;
  const double tEnd = rays.lastSample() + 0.5;
  for (int a = 0; a < 3; ++a) {
    const auto [o0, o1] = std::minmax_element(rays.origin[a], rays.origin[a] + kLanes);
    const auto [d0, d1] = std::minmax_element(rays.delta[a], rays.delta[a] + kLanes);
    rays.owner.origin[a] = *o0 + shift_;
    rays.owner.delta[a] = *d0;
    rays.spread[a] = *o1 - *o0;
    rays.spreadDelta[a] = *d1 - *d0;
    widest[a] = rays.spread[a] + tEnd * rays.spreadDelta[a];
  }
  // Footprints up to `apron + 1` voxels wide fit; the epsilon covers the kernel's rounding.
  const double room = kBrickApron + 1 - footprintExtent_;
  rays.packetOwned = std::max({widest.x, widest.y, widest.z}) + 1e-3 <= room;
}

}  // namespace kairos
