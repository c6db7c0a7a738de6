// The two formulas every renderer of the project shares: opacity correction and the over operator.
#pragma once

#include <cmath>

namespace kairos {

/// Opacity over a distance, from the opacity `alpha` over one unit distance (Beer-Lambert):
/// alpha(d) = 1 - (1 - alpha)^(d/unit). `distanceInUnits` is d/unit.
inline double correctedOpacity(double alpha, double distanceInUnits) {
  if (alpha >= 1.0) return distanceInUnits > 0 ? 1.0 : 0.0;
  return -std::expm1(distanceInUnits * std::log1p(-alpha));
}

/// Front-to-back over of premultiplied colours: `front` receives `back` behind it. The last of the `Channels` that
/// composite like a colour may be anything premultiplied (a depth, for example); alpha is channel 3.
/// Porter and Duff 1984. Never fused: the scalar oracle must not depend on the compiler.
template <int Channels, class Real>
inline void over(Real* front, const Real* back) {
  const Real transmittance = Real(1) - front[3];
  for (int c = 0; c < Channels; ++c) front[c] += transmittance * back[c];
}

}  // namespace kairos
