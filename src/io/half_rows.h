// Between 32-bit and 16-bit floats, many at a time.
#pragma once

#include <half.h>

#include <cstddef>

namespace kairos {

/// Rounds `count` floats to the nearest half (ties to even; beyond its range to infinity).
void toHalves(const float* values, size_t count, half* out);
/// The floats of `count` halves that stand anywhere in memory.
void toFloats(const char* halves, size_t count, float* out);

}  // namespace kairos
