#include "tcdvrm/selection_probability.h"

#include <algorithm>

namespace kairos {

double selectionProbability(uint64_t changed, uint64_t influence, uint64_t sampled) {
  if (sampled + influence > changed) return 1;
  // The quotient of binomials is symmetric in `influence` and `sampled`: a product of the fewer factors.
  const uint64_t few = std::min(influence, sampled), many = std::max(influence, sampled);
  double missed = 1;
  for (uint64_t i = 0; i < few && missed > 0; ++i) missed *= double(changed - many - i) / double(changed - i);
  return 1 - missed;
}

}  // namespace kairos
