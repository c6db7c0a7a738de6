#include "lod_volumes.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace kairos::bench {
namespace {

double gauss(double x) {
  return std::exp(-x * x);
}

// 0 to 1 over a transition of the given width around `edge`.
double rise(double x, double edge, double width) {
  return 1 / (1 + std::exp(-(x - edge) / (0.25 * width)));
}

double whiteNoise(const Vec3i& v) {
  uint64_t h = uint64_t(v.x) * 0x9e3779b97f4a7c15ull ^ uint64_t(v.y) * 0xc2b2ae3d27d4eb4full ^
               uint64_t(v.z) * 0x165667b19e3779f9ull;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return double((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

// Position in units of the domain: 0 to 1 along each axis.
using Function = std::function<double(const Vec3d& position, const Vec3i& voxel)>;

LodVolumeScene sampled(std::string name, const Vec3i& dims, const Function& f, ThreadPool& pool) {
  std::vector<float> values(size_t(dims.x) * size_t(dims.y) * size_t(dims.z));
  pool.forEach(size_t(dims.z), 1, [&](size_t begin, size_t end) {
    for (size_t z = begin; z < end; ++z)
      for (int y = 0; y < dims.y; ++y)
        for (int x = 0; x < dims.x; ++x) {
          const Vec3d p{(x + 0.5) / dims.x, (y + 0.5) / dims.y, (double(z) + 0.5) / dims.z};
          values[(z * size_t(dims.y) + size_t(y)) * size_t(dims.x) + size_t(x)] = float(f(p, {x, y, int(z)}));
        }
  });
  LodVolumeScene scene;
  scene.name = std::move(name);
  scene.lattice.type = ElementType::f32;
  scene.lattice.domain = {{0, 0, 0}, dims};
  scene.lattice.dense = true;
  scene.field = fieldFromDense(values.data(), dims, 0.0f);
  return scene;
}

double vortex(double x, double z, double u, double side) {
  const double radius = 0.012 + 0.05 * u, burst = rise(u, 0.68, 0.15);
  const double wobble = burst * 0.03 * std::sin(70 * u);
  const double dx = x - (0.5 + side * 0.3 * u) - wobble, dz = z - (0.06 + 0.1 * u) - wobble;
  const double d = std::hypot(dx, dz) / (radius * (1 + 0.8 * burst)), angle = std::atan2(dz, side * dx);
  // The core, and the shear layer that winds around it.
  const double core = gauss(d) * (1 - 0.45 * burst * (1 + std::sin(5 * angle + 90 * u)) / 2);
  const double turns = d - (1.7 + 0.35 * angle / std::numbers::pi);
  const double ripples = 1 + 0.5 * std::sin(8 * angle - 60 * u);
  return core + 0.35 * gauss(turns / 0.22) * ripples;
}

}  // namespace

LodVolumeScene deltaWing(ThreadPool& pool) {
  const Vec3i dims{222, 253, 103};
  auto scene = sampled(
      "delta wing", dims,
      [&](const Vec3d& p, const Vec3i&) {
        // One unit is the chord; the wing's apex stands at y = 0.05.
        const double x = p.x * dims.x / dims.y + 0.5 * (1 - double(dims.x) / dims.y);
        const double z = p.z * dims.z / dims.y - 0.06, u = std::max(0.0, p.y - 0.05);
        const double wing = gauss((z - 0.01) / 0.006) * rise(0.42 * u, std::abs(x - 0.5), 0.01);
        const double flow = vortex(x, z, u, 1) + vortex(x, z, u, -1);
        return std::min(1.0, 0.9 * rise(u, 0.02, 0.04) * flow + 0.25 * wing);
      },
      pool);
  scene.transferFunction = TransferFunction(
      {{0, {0.1, 0.2, 0.8}}, {0.35, {0.1, 0.8, 0.9}}, {0.6, {1, 0.85, 0.2}}, {1, {1, 0.15, 0.1}}},
      {{0, 0}, {0.05, 0}, {0.2, 0.01}, {0.5, 0.03}, {0.8, 0.25}, {1, 0.5}});
  scene.paperSubvolumes = 33;
  return scene;
}

LodVolumeScene brain(ThreadPool& pool) {
  auto scene = sampled(
      "brain", {256, 256, 145},
      [](const Vec3d& p, const Vec3i& voxel) {
        const double x = (p.x - 0.5) / 0.40, y = (p.y - 0.5) / 0.46, z = (p.z - 0.45) / 0.52;
        const double r = std::sqrt(x * x + y * y + z * z);
        const double folds = std::sin(14 * x + 4 * std::sin(6 * y + 2 * z)) *
                             std::sin(13 * y + 4 * std::sin(7 * z - 3 * x)) *
                             std::cos(12 * z + 3 * std::sin(8 * x));
        const double depth = r + 0.06 * folds + 0.05 * gauss(x / 0.03) * rise(z, -0.2, 0.3);
        const double head = rise(1, r, 0.03), skull = rise(0.92, r, 0.02), inside = rise(0.85, r, 0.02);
        const double grey = rise(0.79, depth, 0.03), white = rise(0.64, depth, 0.05);
        const double ventricle =
            gauss((std::abs(x) - 0.12) / 0.07) * gauss((y - 0.05) / 0.28) * gauss((z - 0.05) / 0.16);
        const double tissue =
            0.5 * head - 0.38 * skull + 0.08 * inside + 0.4 * grey + 0.22 * white - 0.6 * ventricle * white;
        return std::max(0.0, tissue + 0.03 * (whiteNoise(voxel) - 0.5));
      },
      pool);
  scene.transferFunction = TransferFunction(
      {{0, {0.5, 0.3, 0.25}}, {0.45, {0.9, 0.65, 0.5}}, {0.6, {0.75, 0.6, 0.6}}, {0.85, {0.95, 0.95, 0.9}}},
      {{0, 0}, {0.06, 0}, {0.45, 0.012}, {0.55, 0.02}, {0.65, 0.12}, {0.85, 0.3}, {1, 0.3}});
  scene.paperSubvolumes = 39;
  return scene;
}

}  // namespace kairos::bench
