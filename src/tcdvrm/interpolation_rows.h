// The arithmetic of interpolating rows of pixels, in the widest registers this machine has.
#pragma once

#include <cstddef>

namespace kairos {

/// out[k] = cubic(a[k], b[k], c[k], d[k]), the value half-way between b and c, plus `share` * out[k] where
/// that is not 0. `floats` is four times the number of pixels. `limited`: no colour below 0, no opacity above
/// 1. Every instruction set gives the same bits.
void interpolateFloats(const float* a, const float* b, const float* c, const float* d, float share,
                       bool limited, float* out, size_t floats);

/// out[k] -= cubic(a[k], b[k], c[k], d[k]).
void subtractInterpolation(const float* a, const float* b, const float* c, const float* d, float* out,
                           size_t floats);

}  // namespace kairos
