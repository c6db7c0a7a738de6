#include "raycast/reference_caster.h"

#include <limits>

#include "raycast/scalar_sampling.h"

namespace kairos {
namespace {

template <class Real>
void clearPartial(RenderMode mode, Real* partial) {
  std::fill_n(partial, 5, Real(0));
  if (mode == RenderMode::mip) partial[0] = -std::numeric_limits<Real>::infinity();
}

// A pixel in the making: up to five channels and the transmittance.
constexpr int kPixelPlanes = 6;

int planeCount(const KernelScene& scene) {
  return scene.mode != RenderMode::dvr ? 1 : scene.depth ? 6 : 5;
}

// Puts a partial behind a pixel. True when the ray ends.
template <class Real>
bool addPartial(const KernelScene& scene, const EarlyTermination<Real>& termination, const Real* partial,
                Real* pixel) {
  if (scene.mode == RenderMode::mip) {
    pixel[0] = std::max(pixel[0], partial[0]);
    return false;
  }
  if (scene.mode == RenderMode::average) {
    pixel[0] += partial[0];
    return false;
  }
  return scene.depth ? addBehind<5>(termination, pixel, partial) : addBehind<4>(termination, pixel, partial);
}

template <class Real>
void clearPixel(const KernelScene& scene, Real* pixel) {
  std::fill_n(pixel, kPixelPlanes, Real(0));
  if (scene.mode == RenderMode::dvr) pixel[planeCount(scene) - 1] = 1;  // transmittance
  if (scene.mode == RenderMode::mip) pixel[0] = -std::numeric_limits<Real>::infinity();
}

// ---- the scalar kernel ----

struct SampleSpan {
  int32_t begin, end;
};

SampleSpan laneSpan(const KernelScene& scene, const TileRays& rays, const Segment& segment, const Vec3d& base,
                    int lane) {
  SampleSpan span{std::max(segment.kBegin, rays.kBegin[lane]), std::min(segment.kEnd, rays.kEnd[lane])};
  if (!rays.packetOwned)
    for (int a = 0; a < 3; ++a) {
      const double origin = rays.origin[a][lane] + scene.footprintShift, delta = rays.delta[a][lane];
      const double low = base[a], high = base[a] + kBrickEdge;
      span.begin = std::max(span.begin, firstSampleBeyond(delta < 0 ? high : low, origin, delta));
      span.end = std::min(span.end, firstSampleBeyond(delta < 0 ? low : high, origin, delta));
    }
  return span;
}

Vec3d brickBase(const KernelScene& scene, uint32_t cell) {
  return Vec3d(cellCoordinates(cell, scene.gridSize) * kBrickEdge);
}

// Where a lane's slabs end within samples [span), in lattice steps from its first: cut evenly, then clipped
// to the volume.
template <class Real>
class SlabCuts {
 public:
  SlabCuts(const TileRays& rays, int lane, SampleSpan span, int level)
      : slabs_(slabCount(span.end - span.begin, level)),
        length_(Real(span.end - span.begin) / Real(slabs_)),
        enter_(Real(rays.kBegin[lane] - span.begin) + Real(rays.enter[lane])),
        leave_(std::max(enter_, Real(rays.kEnd[lane] - span.begin) - Real(rays.leave[lane]))) {}
  int32_t slabs() const { return slabs_; }
  Real at(int32_t end) const { return std::clamp(Real(end) * length_, enter_, leave_); }
  Real width(int32_t slab) const { return at(slab + 1) - at(slab); }
  bool whole(int32_t slab) const { return width(slab) > Real(kWholeSlab) * length_; }

 private:
  int32_t slabs_;
  Real length_, enter_, leave_;
};

// What kCurvature takes off the value at an end. The first and the last end, and none between slabs that the
// volume's boundary cuts, lack a neighbour; the former take the next end's.
template <class Real>
Real curvature(const SlabCuts<Real>& cuts, const std::vector<Real>& value, int32_t end) {
  if (cuts.slabs() < 2) return 0;
  const int32_t i = std::clamp(end, 1, cuts.slabs() - 1);
  if (!cuts.whole(i - 1) || !cuts.whole(i)) return 0;
  const size_t n = size_t(i);
  return Real(kCurvature) * (value[n - 1] - 2 * value[n] + value[n + 1]);
}

// The slabs of samples [span) of a lane behind what `partial` holds.
template <class T, class Real>
void addSlabs(const KernelScene& scene, const TileRays& rays, int lane, SampleSpan span, uint32_t cell,
              Real* partial, TileCounters& counters) {
  if (span.end <= span.begin || rays.kBegin[lane] >= rays.kEnd[lane]) return;
  const Vec3d base = brickBase(scene, cell);
  const SlabCuts<Real> cuts(rays, lane, span, scene.levels[cell] + scene.levelBias);
  std::vector<Real> value;
  for (int32_t i = 0; i <= cuts.slabs(); ++i) {
    std::array<Real, 3> local;
    for (int a = 0; a < 3; ++a)
      local[size_t(a)] = Real(rays.origin[a][lane] - base[a] + span.begin * rays.delta[a][lane]) +
                         cuts.at(i) * Real(rays.delta[a][lane]);
    value.push_back(ScalarSampler<T, Real>(scene, static_cast<const T*>(scene.bricks[cell]), local).value());
  }
  counters.samples += value.size();
  SlabEnd<Real> previous;
  for (int32_t i = 0; i <= cuts.slabs(); ++i) {
    const SlabEnd<Real> end = slabEnd(scene, value[size_t(i)] - curvature(cuts, value, i));
    if (i > 0 && cuts.width(i - 1) > 0) addSlab(scene, previous, end, cuts.width(i - 1), partial);
    previous = end;
  }
}

template <class T>
void integrateScalar(const KernelScene& scene, const TileRays& rays, const Segment& segment, int channels,
                     float* partial, TileCounters& counters) {
  const Vec3d base = brickBase(scene, segment.cell);
  const T* brick = static_cast<const T*>(scene.bricks[segment.cell]);
  ++counters.segmentsIntegrated;
  for (int lane = 0; lane < kLanes; ++lane) {
    float sums[5];
    clearPartial(scene.mode, sums);
    if (scene.slabs) {
      const SampleSpan span = rays.packetOwned ? SampleSpan{segment.kBegin, segment.kEnd}
                                               : laneSpan(scene, rays, segment, base, lane);
      addSlabs<T>(scene, rays, lane, span, segment.cell, sums, counters);
    }
    const SampleSpan span = laneSpan(scene, rays, segment, base, lane);
    for (int32_t k = span.begin; k < span.end && !scene.slabs; ++k)
      addSample(scene, rays, lane, k, brick, base, sums, counters);
    for (int c = 0; c < channels; ++c) partial[c * kLanes + lane] = sums[c];
  }
}

// Puts a segment's partials behind a tile's pixels. True when all rays have terminated.
bool compositeScalar(const KernelScene& scene, const float* partial, int channels, float* pixels) {
  bool allDone = scene.mode == RenderMode::dvr;
  const int planes = planeCount(scene);
  EarlyTermination<float> termination(1);
  termination.minimum = scene.terminateMinimum;
  termination.slope = scene.terminateSlope;
  for (int lane = 0; lane < kLanes; ++lane) {
    float pixel[kPixelPlanes], back[5];
    for (int p = 0; p < planes; ++p) pixel[p] = pixels[p * kLanes + lane];
    for (int c = 0; c < channels; ++c) back[c] = partial[c * kLanes + lane];
    const bool done = addPartial(scene, termination, back, pixel);
    for (int p = 0; p < planes; ++p) pixels[p * kLanes + lane] = pixel[p];
    allDone = allDone && done;
  }
  return allDone;
}

// mip: the samples of a skipped segment are all background.
void meetBackground(const KernelScene& scene, const TileRays& rays, const Segment& segment, float* pixels) {
  const Vec3d base = brickBase(scene, segment.cell);
  for (int lane = 0; lane < kLanes; ++lane) {
    const SampleSpan span = laneSpan(scene, rays, segment, base, lane);
    if (span.begin < span.end) pixels[lane] = std::max(pixels[lane], scene.background);
  }
}

template <class T>
void castTileScalar(const KernelScene& scene, const TileTask& task, TileCounters& counters) {
  const int channels = scene.mode == RenderMode::dvr ? (scene.depth ? 5 : 4) : 1;
  for (int lane = 0; lane < kLanes; ++lane) {
    float pixel[kPixelPlanes];
    clearPixel(scene, pixel);
    for (int p = 0; p < planeCount(scene); ++p) task.pixels[p * kLanes + lane] = pixel[p];
  }
  float scratch[5 * kLanes];
  for (uint32_t s = 0; s < task.segmentCount; ++s) {
    const Segment& segment = task.segments[s];
    if (!scene.visible[segment.cell]) {
      ++counters.segmentsSkipped;
      if (scene.mode == RenderMode::mip) meetBackground(scene, *task.rays, segment, task.pixels);
      continue;
    }
    float* partial = task.partials ? task.partials + size_t(s) * size_t(channels) * kLanes : scratch;
    if (task.partials == nullptr || task.stale[s]) {
      integrateScalar<T>(scene, *task.rays, segment, channels, partial, counters);
      if (task.partials) task.stale[s] = 0;
    }
    ++counters.segmentsComposited;
    if (compositeScalar(scene, partial, channels, task.pixels)) break;
  }
}

// ---- the oracle ----

// Which cell owns sample k along one axis, asked anew for every sample.
int32_t owningCell(double origin, double delta, int32_t k, int32_t cells) {
  auto cell = int32_t(std::floor((origin + (k + 0.5) * delta) / kBrickEdge));
  if (delta < 0) {
    while (k < firstSampleBeyond(double(cell + 1) * kBrickEdge, origin, delta)) ++cell;
    while (k >= firstSampleBeyond(double(cell) * kBrickEdge, origin, delta)) --cell;
  } else {
    while (k < firstSampleBeyond(double(cell) * kBrickEdge, origin, delta)) --cell;
    while (k >= firstSampleBeyond(double(cell + 1) * kBrickEdge, origin, delta)) ++cell;
  }
  return std::clamp(cell, 0, cells - 1);
}

// One past the last sample from k on that belongs to `cell`.
int32_t runEnd(const LatticeRay& owner, const Vec3i& cell, int32_t end) {
  for (int a = 0; a < 3; ++a)
    end = std::min(end, firstSampleBeyond(double(cell[a] + (owner.delta[a] < 0 ? 0 : 1)) * kBrickEdge,
                                          owner.origin[a], owner.delta[a]));
  return end;
}

// The slabs of a ray: a packet-owned tile's lanes share their cuts.
template <class T>
void castSlabs(const KernelScene& scene, const EarlyTermination<double>& termination, const LatticeRay& owner,
               const TileRays& rays, int lane, double* pixel, TileCounters& counters) {
  clearPixel(scene, pixel);
  int32_t k = rays.packetOwned ? rays.firstSample() : rays.kBegin[lane];
  const int32_t end = rays.packetOwned ? rays.lastSample() : rays.kEnd[lane];
  while (k < end) {
    Vec3i cell;
    for (int a = 0; a < 3; ++a) cell[a] = owningCell(owner.origin[a], owner.delta[a], k, scene.gridSize[a]);
    const int32_t stop = std::max(k + 1, runEnd(owner, cell, end));
    double partial[5];
    clearPartial(scene.mode, partial);
    addSlabs<T>(scene, rays, lane, {k, stop}, cellIndex(cell, scene.gridSize), partial, counters);
    if (addPartial(scene, termination, partial, pixel)) return;
    k = stop;
  }
}

template <class T>
void castRay(const KernelScene& scene, const EarlyTermination<double>& termination, const ViewRays& view,
             const TileRays& rays, int lane, double* pixel, TileCounters& counters) {
  LatticeRay owner = rays.owner;
  if (!rays.packetOwned)
    for (int a = 0; a < 3; ++a) {
      owner.origin[a] = rays.origin[a][lane] + view.footprintShift();
      owner.delta[a] = rays.delta[a][lane];
    }
  if (scene.slabs) return castSlabs<T>(scene, termination, owner, rays, lane, pixel, counters);
  clearPixel(scene, pixel);
  double partial[5];
  clearPartial(scene.mode, partial);
  Vec3i current{-1, -1, -1};
  bool terminated = false;
  for (int32_t k = rays.kBegin[lane]; k < rays.kEnd[lane] && !terminated; ++k) {
    Vec3i cell;
    for (int a = 0; a < 3; ++a) cell[a] = owningCell(owner.origin[a], owner.delta[a], k, scene.gridSize[a]);
    if (cell != current && current.x >= 0) {
      terminated = addPartial(scene, termination, partial, pixel);
      clearPartial(scene.mode, partial);
      if (terminated) return;
    }
    current = cell;
    const uint32_t index = cellIndex(cell, scene.gridSize);
    addSample(scene, rays, lane, k, static_cast<const T*>(scene.bricks[index]), Vec3d(cell * kBrickEdge),
              partial, counters);
  }
  if (current.x >= 0) addPartial(scene, termination, partial, pixel);
}

}  // namespace

TileKernel scalarKernel(const KernelScene& scene) {
  return dispatch(scene.type, []<class T>() -> TileKernel { return &castTileScalar<T>; });
}

ReferenceCaster::ReferenceCaster(const RenderSettings& settings, const BrickVolume& volume)
    : settings_(settings),
      table_(settings.classification(volume.lattice())),
      occupancy_(settings, table_),
      levels_(settings, table_),
      view_(settings, volume.lattice(), volume.gridOrigin()) {
  ThreadPool pool(1);
  levels_.build(volume, pool);
  scene_ = makeKernelScene(settings, volume, table_, occupancy_, levels_);
}

void ReferenceCaster::cast(int tile, double* pixels, TileCounters& counters) const {
  const TileRays rays = view_.rays(tile);
  const EarlyTermination<double> termination(settings_.terminate);
  const auto channels = size_t(settings_.channels());
  for (int lane = 0; lane < kLanes; ++lane) {
    double pixel[kPixelPlanes];
    dispatch(scene_.type,
             [&]<class T>() { castRay<T>(scene_, termination, view_, rays, lane, pixel, counters); });
    std::copy_n(pixel, channels, pixels + size_t(lane) * channels);
  }
}

std::vector<double> castReference(const RenderSettings& settings, const BrickVolume& volume) {
  const ReferenceCaster caster(settings, volume);
  const ViewRays& view = caster.view();
  const auto channels = size_t(settings.channels());
  std::vector<double> image(size_t(settings.width) * size_t(settings.height) * channels);
  TileCounters counters;
  double pixels[kLanes * 5];
  for (int tile = 0; tile < view.tileCount(); ++tile) {
    caster.cast(tile, pixels, counters);
    for (int lane = 0; lane < kLanes; ++lane) {
      const int x = tile % view.tilesX() * kTileEdge + lane % kTileEdge,
                y = tile / view.tilesX() * kTileEdge + lane / kTileEdge;
      if (x >= settings.width || y >= settings.height) continue;
      std::copy_n(pixels + size_t(lane) * channels, channels,
                  &image[(size_t(y) * size_t(settings.width) + size_t(x)) * channels]);
    }
  }
  return image;
}

}  // namespace kairos
