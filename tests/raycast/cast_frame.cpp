#include "raycast/cast_frame.h"

#include <hwy/targets.h>

#include <algorithm>
#include <cmath>

namespace kairos::test {

Caster::Caster(const Scene& scene, const RenderSettings& settings) : settings_(settings) {
  settings_.validate();
  table_ = settings_.classification(scene.lattice);
  volume_ = std::make_unique<BrickVolume>(scene.lattice, scene.field, pool_);
  view_ = std::make_unique<ViewRays>(settings_, scene.lattice, volume_->gridOrigin());
  occupancy_ = std::make_unique<Occupancy>(settings_, table_);
  occupancy_->build(*volume_);
  levels_ = std::make_unique<SlabLevels>(settings_, table_);
  levels_->build(*volume_, pool_);
  kernelScene_ = makeKernelScene(settings_, *volume_, table_, *occupancy_, *levels_);
}

CastFrame Caster::emptyFrame() const {
  CastFrame frame;
  frame.channels = settings_.channels();
  frame.pixels.resize(size_t(settings_.width) * size_t(settings_.height) * size_t(frame.channels));
  return frame;
}

void Caster::place(int tile, const float* tilePixels, CastFrame& frame) const {
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = tile % view_->tilesX() * kTileEdge + lane % kTileEdge,
              y = tile / view_->tilesX() * kTileEdge + lane / kTileEdge;
    if (x >= settings_.width || y >= settings_.height) continue;
    for (int c = 0; c < frame.channels; ++c)
      frame.pixels[size_t((y * settings_.width + x) * frame.channels + c)] = tilePixels[c * kLanes + lane];
  }
}

CastFrame Caster::cast(const NamedKernel& kernel) const {
  CastFrame frame = emptyFrame();
  std::vector<float> pixels(size_t(settings_.pixelPlanes()) * kLanes);
  std::vector<Segment> segments;
  for (int tile = 0; tile < view_->tileCount(); ++tile) {
    const TileRays rays = view_->rays(tile);
    segments.clear();
    listSegments(*view_, rays, volume_->gridSize(), segments);
    kernel.cast(kernelScene_,
                {&rays, segments.data(), uint32_t(segments.size()), nullptr, nullptr, pixels.data()},
                frame.counters);
    place(tile, pixels.data(), frame);
  }
  return frame;
}

std::vector<int> Caster::sampleCounts() const {
  std::vector<int> counts(size_t(settings_.width) * size_t(settings_.height));
  for (int tile = 0; tile < view_->tileCount(); ++tile) {
    const TileRays rays = view_->rays(tile);
    for (int lane = 0; lane < kLanes; ++lane) {
      const int x = tile % view_->tilesX() * kTileEdge + lane % kTileEdge,
                y = tile / view_->tilesX() * kTileEdge + lane / kTileEdge;
      if (x < settings_.width && y < settings_.height)
        counts[size_t(y * settings_.width + x)] = rays.kEnd[lane] - rays.kBegin[lane];
    }
  }
  return counts;
}

namespace {

const char* packetName(Isa isa) {
  return isa == Isa::avx512 ? "packet avx512" : isa == Isa::avx2 ? "packet avx2" : "packet sse4";
}

}  // namespace

std::vector<NamedKernel> Caster::kernels() const {
  std::vector<NamedKernel> all;
  std::vector<Isa> isas = supportedIsas();
  for (Isa isa : isas)
    if (const TileKernel packet = packetKernel(kernelScene_, isa)) all.push_back({packetName(isa), packet});
  // What a machine without VBMI would run.
  hwy::SetSupportedTargetsForTest(hwy::SupportedTargets() & ~HWY_AVX3_DL);
  if (const TileKernel packet = packetKernel(kernelScene_, Isa::avx512))
    all.push_back({"packet avx512 without VBMI", packet});
  hwy::SetSupportedTargetsForTest(0);
  isas.push_back(Isa::scalar);
  for (Isa isa : isas) all.push_back({kairos::name(isa), generalKernel(kernelScene_, isa)});
  return all;
}

Deviation deviation(const Caster& caster, const CastFrame& frame, const std::vector<double>& reference) {
  const RenderSettings& settings = caster.settings();
  const std::vector<int> counts = caster.sampleCounts();
  const double scale = settings.mode == RenderMode::dvr ? 1 : fullScale(caster.volume().lattice().type);
  Deviation result;
  const auto channels = size_t(frame.channels);
  for (size_t p = 0; p < counts.size(); ++p) {
    double worst = 0;
    for (size_t c = 0; c < channels; ++c) {
      const double expected = reference[p * channels + c], found = double(frame.pixels[p * channels + c]);
      if (expected == found) continue;  // infinities too
      double unit = scale;
      if (c == 4) unit = 2 * (1 + expected / reference[p * channels + 3]);
      if (settings.mode == RenderMode::average) unit *= std::max(1, counts[p]);
      const double difference = std::abs(found - expected) / unit;
      worst = std::max(worst, std::isnan(difference) ? HUGE_VAL : difference);
    }
    result.largest = std::max(result.largest, worst);
    result.pixelsBeyond += worst > 1e-5;
  }
  return result;
}

// ---- the direct oracle ----

namespace {

// A dense copy of the domain and two voxels around it; reading beyond is the background.
class DenseField {
 public:
  explicit DenseField(const Scene& scene)
      : box_{scene.lattice.domain.lo - Vec3i{2, 2, 2}, scene.lattice.domain.hi + Vec3i{2, 2, 2}},
        background_(scene.field.background) {
    for (int z = box_.lo.z; z < box_.hi.z; ++z)
      for (int y = box_.lo.y; y < box_.hi.y; ++y)
        for (int x = box_.lo.x; x < box_.hi.x; ++x)
          values_.push_back(scene.field.value(scene.lattice.sourceOf({x, y, z})));
  }
  double voxel(const Vec3i& v) const {
    const Vec3i p = v - box_.lo, s = box_.size();
    return box_.contains(v) ? values_[size_t((p.z * s.y + p.y) * s.x + p.x)] : background_;
  }
  double nearest(const Vec3d& p) const { return voxel(floored(p + Vec3d{0.5, 0.5, 0.5})); }
  double trilinear(const Vec3d& p) const {
    const Vec3i low = floored(p);
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      Vec3i v = low;
      for (int a = 0; a < 3; ++a) {
        const bool high = (corner >> a & 1) != 0;
        weight *= high ? p[a] - low[a] : 1 - (p[a] - low[a]);
        v[a] += high;
      }
      sum += weight * voxel(v);
    }
    return sum;
  }

 private:
  static Vec3i floored(const Vec3d& p) {
    return {int32_t(std::floor(p.x)), int32_t(std::floor(p.y)), int32_t(std::floor(p.z))};
  }
  VoxelBox box_;
  double background_;
  std::vector<double> values_;
};

bool inside(const PointBox& box, const Vec3d& p) {
  // Generous by a rounding: a sample on the very edge classifies the same on either side for these fields.
  for (int a = 0; a < 3; ++a)
    if (p[a] < box.lo[a] - 1e-9 || p[a] > box.hi[a] + 1e-9) return false;
  return true;
}

}  // namespace

std::vector<double> castFieldDirectly(const Scene& scene, const RenderSettings& settings) {
  const DenseField field(scene);
  const ClassificationTable table = settings.classification(scene.lattice);
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  const Affine indexFromWorld = scene.lattice.worldFromIndex.inverse();
  const PointBox box = scene.lattice.samplingBox(), world = scene.lattice.worldBounds();
  const double step = settings.worldStep(scene.lattice);
  const Vec3d centre = (world.lo + world.hi) * 0.5;
  const double radius = length(world.hi - world.lo);
  std::vector<double> image;
  for (int y = 0; y < settings.height; ++y)
    for (int x = 0; x < settings.width; ++x) {
      const Ray ray = generator.ray(x + 0.5, y + 0.5);
      double colour[4] = {0, 0, 0, 0}, largest = -HUGE_VAL, sum = 0;
      const double away = length(ray.origin - centre);
      const int first = std::max(0, int((away - radius) / step) - 2), last = int((away + radius) / step) + 2;
      for (int k = first; k < last; ++k) {
        const Vec3d world3 = ray.origin + ray.direction * ((k + 0.5) * step),
                    p = indexFromWorld.point(world3);
        if (!inside(box, p) || (settings.clipBox && !inside(*settings.clipBox, world3))) continue;
        const double value = settings.filter == Filter::trilinear ? field.trilinear(p) : field.nearest(p);
        largest = std::max(largest, value);
        sum += value - scene.field.background;
        const auto sample = table.classify(value);
        const double transmittance = 1 - colour[3];
        for (size_t c = 0; c < 4; ++c) colour[c] += transmittance * sample[c];
      }
      if (settings.mode == RenderMode::dvr)
        image.insert(image.end(), colour, colour + 4);
      else
        image.push_back(settings.mode == RenderMode::mip ? largest : sum);
    }
  return image;
}

}  // namespace kairos::test
