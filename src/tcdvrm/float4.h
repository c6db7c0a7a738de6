// Four floats side by side: the RGBA of a pixel.
#pragma once

#include <cstring>

namespace kairos {

using Float4 = float __attribute__((vector_size(16)));

inline Float4 load4(const float* rgba) {
  Float4 v;
  std::memcpy(&v, rgba, sizeof v);
  return v;
}
inline void store4(float* rgba, Float4 v) {
  std::memcpy(rgba, &v, sizeof v);
}
inline float sum4(Float4 v) {
  return v[0] + v[1] + v[2] + v[3];
}

/// The value half-way between b and c of four equidistant ones: the cubic through them (four-point
/// subdivision; Deslauriers and Dubuc 1989).
inline Float4 cubicBetween(Float4 a, Float4 b, Float4 c, Float4 d) {
  return 0.5625f * (b + c) - 0.0625f * (a + d);
}

}  // namespace kairos
