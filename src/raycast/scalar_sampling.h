// Sampling, classification and shading of one sample at a time, in float or double: the readable form of what
// the SIMD kernels do, and the oracle they are tested against.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/compositing.h"
#include "raycast/headlight.h"
#include "raycast/scalar_slabs.h"
#include "raycast/tile_kernel.h"

namespace kairos {

template <class Real>
struct ScalarSample {
  std::array<Real, 4> colour{};  // premultiplied, opacity-corrected
  Real value{};
};

/// Samples one brick at positions relative to its first voxel.
template <class T, class Real>
class ScalarSampler {
 public:
  ScalarSampler(const KernelScene& scene, const T* brick, const std::array<Real, 3>& local)
      : scene_(scene), brick_(brick) {
    const bool trilinear = scene.filter == Filter::trilinear;
    const int margin = scene.shade ? 1 : 0, highest = kBrickStride - (trilinear ? 2 : 1) - margin;
    for (size_t a = 0; a < 3; ++a) {
      const Real low = std::floor(trilinear ? local[a] : local[a] + Real(0.5));
      corner_[a] = std::clamp(int(low), margin, highest);
      fraction_[a] = local[a] - Real(corner_[a]);
    }
  }

  /// The interpolated value, the footprint shifted by whole voxels.
  Real value(int dx = 0, int dy = 0, int dz = 0) const {
    const int x = corner_[0] + dx, y = corner_[1] + dy, z = corner_[2] + dz;
    if (scene_.filter == Filter::nearest) return voxel(x, y, z);
    const auto lerp = [](Real a, Real b, Real f) { return a + f * (b - a); };
    const auto row = [&](int ry, int rz) {
      return lerp(voxel(x, ry, rz), voxel(x + 1, ry, rz), fraction_[0]);
    };
    return lerp(lerp(row(y, z), row(y + 1, z), fraction_[1]),
                lerp(row(y, z + 1), row(y + 1, z + 1), fraction_[1]), fraction_[2]);
  }

  /// Central differences over +-1 voxel, in index space.
  std::array<Real, 3> gradient() const {
    return {Real(0.5) * (value(1, 0, 0) - value(-1, 0, 0)), Real(0.5) * (value(0, 1, 0) - value(0, -1, 0)),
            Real(0.5) * (value(0, 0, 1) - value(0, 0, -1))};
  }

 private:
  Real voxel(int x, int y, int z) const { return Real(brick_[(z * kBrickStride + y) * kBrickStride + x]); }

  const KernelScene& scene_;
  const T* brick_;
  std::array<int, 3> corner_;
  std::array<Real, 3> fraction_;
};

template <class Real>
std::array<Real, 4> classifyScalar(const KernelScene& scene, Real value) {
  const Real last = Real(scene.lastNode);
  Real x = (value - Real(scene.rangeLo)) * Real(scene.scale);
  x = x > Real(0) ? (x < last ? x : last) : Real(0);
  const int i = int(x);
  const Real f = x - Real(i);
  const auto& [at, slope] = scene.intervals[i];
  const auto along = [f](float a, float s) { return Real(a) + f * Real(s); };
  return {along(at.r, slope.r), along(at.g, slope.g), along(at.b, slope.b), along(at.a, slope.a)};
}

/// Headlight's formula.
template <class Real>
void shadeScalar(const KernelScene& scene, const std::array<Real, 3>& indexGradient,
                 const std::array<Real, 3>& direction, std::array<Real, 4>& colour) {
  Real squared = 0, along = 0;
  for (size_t row = 0; row < 3; ++row) {
    Real g = 0;
    for (size_t a = 0; a < 3; ++a) g += Real(scene.worldFromIndexGradient[row][a]) * indexGradient[a];
    constexpr Real kSteepest = Real(Headlight::kSteepest);
    g = g > -kSteepest ? (g < kSteepest ? g : kSteepest) : -kSteepest;
    squared += g * g;
    along += g * direction[row];
  }
  const Real guarded = squared + Real(scene.flatGradientSquared);
  const Real cosine = std::abs(along) / std::sqrt(guarded), weight = squared / guarded;
  const Real factor =
      Real(1) - weight * (Real(1) - Real(Headlight::kAmbient)) + Real(Headlight::kDiffuse) * cosine;
  const Real c2 = cosine * cosine, c4 = c2 * c2, c8 = c4 * c4;
  const Real highlight = colour[3] * Real(Headlight::kSpecular) * c8 * c8;
  for (size_t c = 0; c < 3; ++c) colour[c] = colour[c] * factor + highlight;
}

/// Adds sample k of one lane, taken from `brick` whose first voxel stands at `brickBase` in grid space,
/// behind what `partial` holds already (dvr), or into its extremum or sum.
template <class T, class Real>
void addSample(const KernelScene& scene, const TileRays& rays, int lane, int32_t k, const T* brick,
               const Vec3d& brickBase, Real* partial, TileCounters& counters) {
  std::array<Real, 3> local, direction;
  for (int a = 0; a < 3; ++a) {
    local[size_t(a)] = Real(rays.origin[a][lane] - brickBase[a] + (k + 0.5) * rays.delta[a][lane]);
    direction[size_t(a)] = Real(rays.direction[a][lane]);
  }
  const ScalarSampler<T, Real> sampler(scene, brick, local);
  const Real value = sampler.value();
  ++counters.samples;
  if (scene.mode == RenderMode::mip) {
    partial[0] = std::max(partial[0], value);
    return;
  }
  if (scene.mode == RenderMode::average) {
    partial[0] += value - Real(scene.background);
    return;
  }
  std::array<Real, 4> colour = classifyScalar(scene, value);
  if (colour[3] == 0) return;
  if (scene.shade) {
    shadeScalar(scene, sampler.gradient(), direction, colour);
    ++counters.gradients;
  }
  const std::array<Real, 5> back{colour[0], colour[1], colour[2], colour[3],
                                 colour[3] * (Real(k) + Real(0.5)) * Real(scene.worldStep)};
  if (scene.depth)
    over<5>(partial, back.data());
  else
    over<4>(partial, back.data());
}

}  // namespace kairos
