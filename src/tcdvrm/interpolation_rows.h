// The arithmetic of interpolating rows of pixels, in the widest registers this machine has.
#pragma once

#include <cstddef>

namespace kairos {

/// Every instruction set gives the same bits.

/// out[k] = cubic(a[k], b[k], c[k], d[k]), the value half-way between b and c. `floats` is four times the
/// number of pixels.
void interpolateRows(const float* a, const float* b, const float* c, const float* d, float* out,
                     size_t floats);

/// out[k] -= share * cubic(a[k], b[k], c[k], d[k]).
void subtractRows(const float* a, const float* b, const float* c, const float* d, float share, float* out,
                  size_t floats);

/// out[k] -= share * a[k].
void subtractRow(const float* a, float share, float* out, size_t floats);

/// What a row of RGBA nodes becomes at half the stride: nodes [begin, end) of it.
struct WidenedRow {
  const float* nodes;       // node k stands at node 2 k of `out`; from begin / 2 - 1 to (end + 3) / 2
  const float* exactNodes;  // what the even nodes of `out` become; null: `nodes`, which are interpolated too
  const float* old;         // numbered like `out`; `share` of it is added to what is interpolated; may be out
  float share;              // 0: `old` is not read
  bool limited;             // no colour below 0, no opacity above 1
};
void widenRow(const WidenedRow& row, int begin, int end, float* out);

}  // namespace kairos
