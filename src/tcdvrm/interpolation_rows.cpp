#include "tcdvrm/interpolation_rows.h"

#include <algorithm>
#include <limits>

// Compiled once per instruction set, chosen when the program is loaded. Sanitizers come too late for that.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define KAIROS_EVERY_X86 __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define KAIROS_EVERY_X86
#endif

namespace kairos {
namespace {

constexpr size_t kStep = 16;  // floats: four pixels
constexpr float kNone = std::numeric_limits<float>::infinity();
constexpr float kLimits[kStep] = {kNone, kNone, kNone, 1, kNone, kNone, kNone, 1,
                                  kNone, kNone, kNone, 1, kNone, kNone, kNone, 1};

}  // namespace

KAIROS_EVERY_X86 void interpolateFloats(const float* a, const float* b, const float* c, const float* d,
                                        float share, bool limited, float* out, size_t floats) {
  if (share != 0)
    for (size_t k = 0; k < floats; ++k)
      out[k] = 0.5625f * (b[k] + c[k]) - 0.0625f * (a[k] + d[k]) + share * out[k];
  else
    for (size_t k = 0; k < floats; ++k) out[k] = 0.5625f * (b[k] + c[k]) - 0.0625f * (a[k] + d[k]);
  if (!limited) return;
  size_t k = 0;
  for (; k + kStep <= floats; k += kStep)
    for (size_t i = 0; i < kStep; ++i) out[k + i] = std::min(std::max(out[k + i], 0.0f), kLimits[i]);
  for (; k < floats; ++k) out[k] = std::min(std::max(out[k], 0.0f), kLimits[k % kStep]);
}

KAIROS_EVERY_X86 void subtractInterpolation(const float* a, const float* b, const float* c, const float* d,
                                            float* out, size_t floats) {
  for (size_t k = 0; k < floats; ++k) out[k] -= 0.5625f * (b[k] + c[k]) - 0.0625f * (a[k] + d[k]);
}

}  // namespace kairos
