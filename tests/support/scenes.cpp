#include "support/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <stdexcept>

namespace kairos::test {

double fullScale(ElementType type) {
  return type == ElementType::u8 ? 255 : type == ElementType::u16 ? 65535 : 1;
}

Lattice denseLattice(ElementType type, const Vec3i& dims, const Vec3i& origin) {
  Lattice lattice;
  lattice.type = type;
  lattice.domain = {origin, origin + dims};
  lattice.dense = true;
  return lattice;
}

Lattice sparseLattice(ElementType type, const Vec3i& dims, const Vec3i& origin) {
  Lattice lattice = denseLattice(type, dims, origin);
  lattice.dense = false;
  return lattice;
}

Field sampledField(const Lattice& lattice, const std::function<double(const Vec3i&)>& value) {
  const VoxelBox& box = lattice.domain;
  return dispatch(lattice.type, [&]<class T>() {
    const double scale = fullScale(lattice.type);
    std::vector<T> dense;
    dense.reserve(size_t(box.voxelCount()));
    for (int z = box.lo.z; z < box.hi.z; ++z)
      for (int y = box.lo.y; y < box.hi.y; ++y)
        for (int x = box.lo.x; x < box.hi.x; ++x) {
          const double v = value({x, y, z}) * scale;
          dense.push_back(std::is_same_v<T, float> ? T(v) : T(std::lround(std::clamp(v, 0.0, scale))));
        }
    return fieldFromDense(dense.data(), box.size(), T(lattice.background), box.lo);
  });
}

// ---- noise ----

double whiteNoise(const Vec3i& v, uint32_t seed) {
  uint64_t h = uint64_t(uint32_t(v.x)) * 0x9e3779b97f4a7c15ull ^
               uint64_t(uint32_t(v.y)) * 0xc2b2ae3d27d4eb4full ^
               uint64_t(uint32_t(v.z)) * 0x165667b19e3779f9ull ^ uint64_t(seed) << 32;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return double((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

double smoothNoise(const Vec3d& position, double period, uint32_t seed) {
  const Vec3d p = position * (1 / period);
  const Vec3i low{int32_t(std::floor(p.x)), int32_t(std::floor(p.y)), int32_t(std::floor(p.z))};
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Vec3i v = low;
    for (int a = 0; a < 3; ++a) {
      const double f = p[a] - low[a], s = f * f * (3 - 2 * f);
      const bool high = (corner >> a & 1) != 0;
      weight *= high ? s : 1 - s;
      v[a] += high;
    }
    sum += weight * whiteNoise(v, seed);
  }
  return sum;
}

// ---- volumes ----

Scene constantScene(ElementType type, const Vec3i& dims, double value) {
  Scene scene{"constant", denseLattice(type, dims), {}};
  scene.field = sampledField(scene.lattice, [&](const Vec3i&) { return value; });
  return scene;
}

Scene marschnerLobb(ElementType type, int edge) {
  Scene scene{"marschnerLobb", denseLattice(type, {edge, edge, edge}), {}};
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) {
    const auto coordinate = [&](int i) { return 2.0 * i / (edge - 1) - 1; };
    constexpr double kAlpha = 0.25, kFrequency = 6, kPi = std::numbers::pi;
    const double r = std::hypot(coordinate(v.x), coordinate(v.y));
    const double rho = std::cos(2 * kPi * kFrequency * std::cos(kPi * r / 2));
    return (1 - std::sin(kPi * coordinate(v.z) / 2) + kAlpha * (1 + rho)) / (2 * (1 + kAlpha));
  });
  return scene;
}

namespace {

// A tube along a bent centre line in the unit cube, eroded by noise that moves with the flow.
double plumeDensity(const Vec3d& p, double time) {
  const double centreX = 0.2 + 0.5 * p.z * p.z, radius = 0.06 + 0.12 * p.z;
  const double distance = std::hypot(p.x - centreX, p.y - 0.5) / radius;
  if (distance >= 1 || p.z < 0.05 || p.z > 0.9) return 0;
  const Vec3d moved = p - Vec3d{0, 0, 0.02 * time};
  const double noise = 0.65 * smoothNoise(moved, 0.11, 7) + 0.35 * smoothNoise(moved, 0.043, 8);
  return std::max(0.0, (1 - distance * distance) * (0.35 + noise) - 0.12);
}

Vec3d unitPosition(const Vec3i& v, const VoxelBox& box) {
  const Vec3d p(v - box.lo), size(box.size());
  return {(p.x + 0.5) / size.x, (p.y + 0.5) / size.y, (p.z + 0.5) / size.z};
}

Lattice plumeLattice(ElementType type, int edge) {
  return sparseLattice(type, {edge, edge - 5, edge + 3}, {-11, 3, -30});
}

}  // namespace

Scene plume(ElementType type, int edge, double time) {
  Scene scene{"plume", plumeLattice(type, edge), {}};
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) {
    return plumeDensity(unitPosition(v, scene.lattice.domain), time);
  });
  return scene;
}

Scene denseNoise(ElementType type, int edge, uint32_t seed) {
  Scene scene{"denseNoise", denseLattice(type, {edge, edge - 3, edge + 1}), {}};
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) { return 0.1 + 0.8 * whiteNoise(v, seed); });
  return scene;
}

Scene sparseBalls(ElementType type, int edge) {
  Scene scene{"sparseBalls", sparseLattice(type, {edge, edge, edge}), {}};
  const std::array<Vec3d, 4> centres{
      Vec3d{0.15, 0.2, 0.2}, {0.8, 0.7, 0.25}, {0.3, 0.75, 0.8}, {0.5, 0.5, 0.5}};
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) {
    double nearest = 1e9;
    for (const Vec3d& c : centres) nearest = std::min(nearest, length(Vec3d(v) - c * edge));
    return std::max(0.0, 1 - nearest / 5.5);
  });
  return scene;
}

Scene movingBall(ElementType type, int edge, double time) {
  Scene scene{"movingBall", plumeLattice(type, edge), {}};
  const Vec3d centre{0.30 + 0.02 * time, 0.5, 0.5};
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) {
    const Vec3d p = unitPosition(v, scene.lattice.domain);
    const double inBall = 1 - length(p - centre) * edge / 4.0;
    return std::min(1.0, plumeDensity(p, 0) + (inBall > 0 ? 0.6 * inBall : 0.0));
  });
  return scene;
}

Scene travellingFront(ElementType type, int edge, double time) {
  Scene scene{"travellingFront", denseLattice(type, {edge, edge - 7, edge - 2}), {}};
  const double front = 6 + 2 * time;
  scene.field = sampledField(scene.lattice, [&](const Vec3i& v) {
    const double behind = std::clamp((front - v.x) / 3, 0.0, 1.0);
    return behind * (0.25 + 0.7 * smoothNoise(Vec3d(v), 9, 3));
  });
  return scene;
}

Scene singleVoxel(ElementType type) {
  Scene scene{"singleVoxel", denseLattice(type, {16, 16, 16}), {}};
  scene.field = sampledField(scene.lattice, [](const Vec3i& v) { return v == Vec3i{5, 6, 7} ? 1.0 : 0.0; });
  return scene;
}

Scene emptyScene(ElementType type, int edge) {
  Scene scene{"empty", sparseLattice(type, {edge, edge, edge}), {}};
  scene.field = sampledField(scene.lattice, [](const Vec3i&) { return 0.0; });
  return scene;
}

Scene jet1(int step) {
  constexpr Vec3i kDims{81, 49, 65};
  char file[32];
  std::snprintf(file, sizeof file, "/data/jet1/jet1_%04d.raw", step);
  const std::string path = KAIROS_BINARY_DIR + std::string(file);
  std::vector<uint8_t> values(size_t(kDims.x) * kDims.y * kDims.z);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(values.data()), std::streamsize(values.size())))
    throw std::runtime_error("cannot read the bundled data " + path);
  Scene scene{"jet1", denseLattice(ElementType::u8, kDims), {}};
  scene.lattice.worldFromIndex = Affine::scale({0.125, 0.125, 0.125});
  scene.field = fieldFromDense(values.data(), kDims);
  return scene;
}

std::vector<Scene> allScenes(ElementType type) {
  return {constantScene(type, {33, 20, 18}, 0.4),
          marschnerLobb(type),
          plume(type),
          denseNoise(type),
          sparseBalls(type),
          movingBall(type),
          travellingFront(type, 48, 8),
          singleVoxel(type),
          emptyScene(type)};
}

// ---- transfer functions ----

namespace {

TransferFunction scaled(ElementType type, std::vector<TransferFunction::OpacityPoint> opacities) {
  const double scale = fullScale(type);
  for (auto& p : opacities) p.value *= scale;
  return {{{0, {0.05, 0.1, 0.6}},
           {0.35 * scale, {0.1, 0.7, 0.4}},
           {0.7 * scale, {0.9, 0.6, 0.1}},
           {scale, {1, 0.95, 0.9}}},
          std::move(opacities)};
}

}  // namespace

TransferFunction softTransferFunction(ElementType type) {
  return scaled(type, {{0, 0}, {0.06, 0}, {0.5, 0.06}, {1, 0.25}});
}

TransferFunction windowedTransferFunction(ElementType type) {
  return scaled(type, {{0, 0},
                       {0.14, 0},
                       {0.2, 0.3},
                       {0.26, 0},
                       {0.44, 0},
                       {0.5, 0.4},
                       {0.56, 0},
                       {0.76, 0},
                       {0.82, 0.5},
                       {0.88, 0},
                       {1, 0}});
}

TransferFunction opaqueTransferFunction(ElementType type) {
  return scaled(type, {{0, 0}, {0.2, 0}, {0.3, 0.95}, {1, 0.99}});
}

std::vector<NamedTransferFunction> allTransferFunctions(ElementType type) {
  return {{"soft", softTransferFunction(type)},
          {"windowed", windowedTransferFunction(type)},
          {"opaque", opaqueTransferFunction(type)}};
}

// ---- cameras ----

const std::vector<std::string>& cameraNames() {
  static const std::vector<std::string> names{"x",          "-y",     "iso",     "close", "inside", "ortho",
                                              "orthoClose", "orthoZ", "grazing", "far",   "wide"};
  return names;
}

namespace {

constexpr double kFov = 30;

Camera perspective(const Vec3d& eye, const Vec3d& target, double fov) {
  Camera camera;
  camera.eye = eye;
  camera.target = target;
  camera.up = {0, 0, 1};
  camera.verticalFovDegrees = fov;
  return camera;
}

}  // namespace

Camera cameraNamed(const std::string& name, const Lattice& lattice) {
  const PointBox box = lattice.worldBounds();
  const Vec3d centre = (box.lo + box.hi) * 0.5, size = box.hi - box.lo;
  const double extent = length(size);
  if (name == "close") {
    Camera camera = fittedCamera("iso", box, kFov, 1);
    camera.verticalFovDegrees = kFov / 3;
    return camera;
  }
  if (name == "inside")
    return perspective(centre + Vec3d{size.x * 0.13, size.y * 0.07, size.z * 0.05}, box.lo, 70);
  if (name == "orthoZ") return fittedOrthographicCamera("z", box, 1);
  if (name == "ortho" || name == "orthoClose") {
    Camera camera = fittedOrthographicCamera("iso", box, 1);
    if (name == "orthoClose") camera.imageHeight /= 3;
    return camera;
  }
  if (name == "grazing")
    return perspective({box.hi.x + 0.02 * size.x, centre.y - extent, centre.z + 0.1 * size.z},
                       {box.hi.x - 0.05 * size.x, centre.y, centre.z}, 25);
  if (name == "far") return perspective(centre + normalized({0.6, -0.5, 0.3}) * (300 * extent), centre, 0.15);
  if (name == "wide") return perspective(centre + normalized({-0.7, 0.6, 0.4}) * (0.6 * extent), centre, 130);
  return fittedCamera(name, box, kFov, 1);
}

RenderSettings settingsFor(const Scene& scene, const std::string& camera, const TransferFunction& tf,
                           int width, int height) {
  RenderSettings settings;
  settings.camera = cameraNamed(camera, scene.lattice);
  settings.width = width;
  settings.height = height;
  settings.transferFunction = tf;
  settings.range = {0, float(fullScale(scene.lattice.type))};
  return settings;
}

}  // namespace kairos::test
