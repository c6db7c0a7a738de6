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
      const double origin = rays.origin[a][lane] + double(scene.footprintShift), delta = rays.delta[a][lane];
      const double low = base[a], high = base[a] + kBrickEdge;
      span.begin = std::max(span.begin, firstSampleBeyond(delta < 0 ? high : low, origin, delta));
      span.end = std::min(span.end, firstSampleBeyond(delta < 0 ? low : high, origin, delta));
    }
  return span;
}

Vec3d brickBase(const KernelScene& scene, uint32_t cell) {
  return Vec3d(cellCoordinates(cell, scene.gridSize) * kBrickEdge);
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
    const SampleSpan span = laneSpan(scene, rays, segment, base, lane);
    for (int32_t k = span.begin; k < span.end; ++k)
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

template <class T>
void castRay(const KernelScene& scene, const EarlyTermination<double>& termination, const ViewRays& view,
             const TileRays& rays, int lane, double* pixel) {
  LatticeRay owner = rays.owner;
  if (!rays.packetOwned)
    for (int a = 0; a < 3; ++a) {
      owner.origin[a] = rays.origin[a][lane] + view.footprintShift();
      owner.delta[a] = rays.delta[a][lane];
    }
  clearPixel(scene, pixel);
  double partial[5];
  clearPartial(scene.mode, partial);
  TileCounters counters;
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

std::vector<double> castReference(const RenderSettings& settings, const BrickVolume& volume) {
  const ClassificationTable table = settings.classification(volume.lattice());
  const KernelScene scene =
      makeKernelScene(settings, volume, table, Occupancy(settings, table));  // empty: never skips
  const ViewRays view(settings, volume.lattice(), volume.gridOrigin());
  const EarlyTermination<double> termination(settings.terminate);
  const auto channels = size_t(settings.channels());
  std::vector<double> image(size_t(settings.width) * size_t(settings.height) * channels);
  for (int tile = 0; tile < view.tileCount(); ++tile) {
    const TileRays rays = view.rays(tile);
    for (int lane = 0; lane < kLanes; ++lane) {
      const int x = tile % view.tilesX() * kTileEdge + lane % kTileEdge,
                y = tile / view.tilesX() * kTileEdge + lane / kTileEdge;
      if (x >= settings.width || y >= settings.height) continue;
      double pixel[kPixelPlanes];
      dispatch(scene.type, [&]<class T>() { castRay<T>(scene, termination, view, rays, lane, pixel); });
      std::copy_n(pixel, channels, &image[(size_t(y) * size_t(settings.width) + size_t(x)) * channels]);
    }
  }
  return image;
}

}  // namespace kairos
