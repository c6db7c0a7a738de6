#include "tcdvrm/interpolation_rows.h"

#include <algorithm>
#include <limits>

#include "tcdvrm/float4.h"

// Compiled once per instruction set, chosen when the program is loaded. Sanitizers come too late for that.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define KAIROS_EVERY_X86 __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define KAIROS_EVERY_X86
#endif

namespace kairos {
namespace {

inline Float4 limitedColour(Float4 v) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  const Float4 least = {0, 0, 0, 0}, most = {kNone, kNone, kNone, 1};
  v = v > least ? v : least;
  return v < most ? v : most;
}

inline Float4 widened(const WidenedRow& row, int i) {
  const float* at = row.nodes + 4 * (i >> 1);
  if (i & 1) return cubicBetween(load4(at - 4), load4(at), load4(at + 4), load4(at + 8));
  return load4(row.exactNodes ? row.exactNodes + 4 * (i >> 1) : at);
}

template <bool kOld, bool kLimited>
void widenNodes(const WidenedRow& row, int begin, int end, float* out) {
  const bool evenToo = row.exactNodes == nullptr;
  const auto finish = [&](int i, bool interpolated) {
    Float4 value = widened(row, i);
    if (kOld && interpolated) value += row.share * load4(row.old + 4 * i);
    store4(out + 4 * i, kLimited ? limitedColour(value) : value);
  };
  if (begin < end && (begin & 1)) finish(begin++, true);
  for (; begin + 1 < end; begin += 2) {
    finish(begin, evenToo);
    finish(begin + 1, true);
  }
  if (begin < end) finish(begin, evenToo);
}

}  // namespace

KAIROS_EVERY_X86 void interpolateRows(const float* a, const float* b, const float* c, const float* d,
                                      float* out, size_t floats) {
  for (size_t k = 0; k < floats; ++k) out[k] = 0.5625f * (b[k] + c[k]) - 0.0625f * (a[k] + d[k]);
}

KAIROS_EVERY_X86 void subtractRows(const float* a, const float* b, const float* c, const float* d,
                                   float share, float* out, size_t floats) {
  for (size_t k = 0; k < floats; ++k) out[k] -= share * (0.5625f * (b[k] + c[k]) - 0.0625f * (a[k] + d[k]));
}

KAIROS_EVERY_X86 void subtractRow(const float* a, float share, float* out, size_t floats) {
  for (size_t k = 0; k < floats; ++k) out[k] -= share * a[k];
}

void widenRow(const WidenedRow& row, int begin, int end, float* out) {
  const auto widen = row.share != 0 ? (row.limited ? widenNodes<true, true> : widenNodes<true, false>)
                                    : (row.limited ? widenNodes<false, true> : widenNodes<false, false>);
  widen(row, begin, end, out);
}

}  // namespace kairos
