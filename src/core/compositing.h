// The formulas every renderer of the project shares: opacity correction, the over operator, early ray
// termination.
#pragma once

#include <algorithm>
#include <cmath>

namespace kairos {

/// Opacity over a distance, from the opacity `alpha` over one unit distance (Beer-Lambert):
/// alpha(d) = 1 - (1 - alpha)^(d/unit). `distanceInUnits` is d/unit.
inline double correctedOpacity(double alpha, double distanceInUnits) {
  if (alpha >= 1.0) return distanceInUnits > 0 ? 1.0 : 0.0;
  return -std::expm1(distanceInUnits * std::log1p(-alpha));
}

/// Optical depth over a distance, from the opacity over one unit distance: 1 - exp(-opticalDepth) is
/// correctedOpacity. Opacity 1, whose depth is infinite, counts as 1 - 2^-16.
inline double opticalDepth(double alpha, double distanceInUnits) {
  return -distanceInUnits * std::log1p(-std::min(alpha, 1 - 0x1p-16));
}

/// Front-to-back over of premultiplied colours: `front` receives `back` behind it. The last of the `Channels`
/// that composite like a colour may be anything premultiplied (a depth, for example); alpha is channel 3.
/// Porter and Duff 1984. Never fused: the scalar oracle must not depend on the compiler.
template <int Channels, class Real>
inline void over(Real* front, const Real* back) {
  const Real transmittance = Real(1) - front[3];
  for (int c = 0; c < Channels; ++c) front[c] += transmittance * back[c];
}

/// Early ray termination without an edge. A ray ends once its transmittance is at or below `minimum`; on the
/// way there, below twice that, what lies behind is faded out: it counts with weight(T) <= T instead of T,
/// which is continuous and reaches zero at `minimum`. A hard stop would let the last bit of rounding decide
/// whether a whole further segment counts, and two correct renderers would differ by `minimum`; so they
/// differ by no more than their rounding. Opacity left out: at most 1.5 * minimum. Colour and alpha fade
/// together, so constant colours stay exact.
template <class Real>
struct EarlyTermination {
  Real minimum, slope;

  /// `alpha` in (0, 1]: the opacity at which a ray ends; 1 never ends one before it is opaque.
  explicit EarlyTermination(float alpha) {
    minimum = Real(1) - Real(alpha);
    const Real fadeFrom = std::min(Real(1), 2 * minimum);
    slope = minimum > 0 ? fadeFrom / (fadeFrom - minimum) : Real(1);
  }
  Real weight(Real transmittance) const {
    return std::max(Real(0), std::min(transmittance, slope * (transmittance - minimum)));
  }
};

/// Puts a segment's partial behind what a ray has gathered. `pixel` has Channels premultiplied values and,
/// behind them, the ray's transmittance (1 at first). True when the ray has ended.
template <int Channels, class Real>
inline bool addBehind(const EarlyTermination<Real>& termination, Real* pixel, const Real* partial) {
  Real& transmittance = pixel[Channels];
  const Real weight = termination.weight(transmittance);
  for (int c = 0; c < Channels; ++c) pixel[c] += weight * partial[c];
  transmittance -= transmittance * partial[3];
  return transmittance <= termination.minimum;
}

}  // namespace kairos
