// Slabs between two values of a ray, one at a time, in float or double: the readable form of
// slab_colours-inl.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/compositing.h"
#include "raycast/tile_kernel.h"

namespace kairos {

/// A slab's end: where the value stands among the nodes of densities.
template <class Real>
struct SlabEnd {
  Real x;                               // node coordinate + 1
  int interval;                         // of KernelScene::densities
  std::array<Real, 4> density, within;  // within: the integral from the interval's start
};

template <class Real, class Scene>
SlabEnd<Real> slabEnd(const Scene& scene, Real value) {
  SlabEnd<Real> end;
  constexpr Real kFarthest = Real(1 << 20);
  end.x = std::clamp((value - Real(scene.rangeLo)) * Real(scene.scale) + Real(1), -kFarthest, kFarthest);
  end.interval = int(std::clamp(end.x, Real(0), Real(scene.lastNode) + Real(1)));
  const auto& [at, slope, integral, padding] = scene.densities[end.interval];
  const Real f = end.x - Real(end.interval);
  const float a[4] = {at.r, at.g, at.b, at.a}, s[4] = {slope.r, slope.g, slope.b, slope.a};
  for (size_t c = 0; c < 4; ++c) {
    end.density[c] = Real(a[c]) + f * Real(s[c]);
    end.within[c] = Real(0.5) * f * (Real(a[c]) + end.density[c]);
  }
  return end;
}

/// What lies between two values along a straight line: the densities' sum over `reach` nodes.
template <class Real>
struct SlabSum {
  std::array<Real, 4> sum;
  Real reach;
};

template <class Real, class Scene>
SlabSum<Real> slabSum(const Scene& scene, const SlabEnd<Real>& a, const SlabEnd<Real>& b) {
  const bool straight = a.interval == b.interval || std::abs(b.x - a.x) < Real(kShortestReach);
  SlabSum<Real> s;
  s.reach = straight ? Real(1) : b.x - a.x;
  const int32_t *from = scene.densities[a.interval].integral, *to = scene.densities[b.interval].integral;
  for (size_t c = 0; c < 4; ++c)
    s.sum[c] = straight ? Real(0.5) * (a.density[c] + b.density[c])
                        : Real(to[c] - from[c]) * Real(scene.integralUnit) + (b.within[c] - a.within[c]);
  return s;
}

/// Puts a slab `width` lattice steps long behind what `partial` holds. Between its ends the value varies
/// linearly; the densities' mean over that is exact, and so is the attenuation of a slab of mean densities.
template <class Real>
void addSlab(const KernelScene& scene, const SlabEnd<Real>& a, const SlabEnd<Real>& b, Real width,
             Real* partial) {
  auto [sum, reach] = slabSum(scene, a, b);
  const Real depth = sum[3] * width / reach;
  if (!(depth > 0)) return;
  const Real share = -std::expm1(-depth) / sum[3];
  for (Real& s : sum) s *= share;
  over<4>(partial, sum.data());
}

}  // namespace kairos
