// How linear colours reach a display.
#pragma once

#include <cmath>

namespace kairos {

/// A linear component as a display can show it: clipped to [0, 1], NaN as black.
inline double displayed(float linear) {
  return linear > 0 ? (linear < 1 ? double(linear) : 1.0) : 0.0;
}

/// The transfer function of IEC 61966-2-1, from linear to encoded, for components in [0, 1].
inline double srgbFromLinear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Its inverse.
inline double linearFromSrgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace kairos
