// Compiled once per instruction set by Highway's foreach_target.
#include "volume/brick_update.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volume/brick_update.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// foreach_target comes first by Highway's rules
#include <hwy/highway.h>

#include "volume/brick_update-inl.h"

#if HWY_ONCE

namespace kairos {
namespace {

HWY_EXPORT(updateU8);
HWY_EXPORT(updateU16);
HWY_EXPORT(updateF32);

}  // namespace

BrickChange updateBrick(const BrickUpdate<uint8_t>& update) {
  return HWY_DYNAMIC_DISPATCH(updateU8)(update);
}
BrickChange updateBrick(const BrickUpdate<uint16_t>& update) {
  return HWY_DYNAMIC_DISPATCH(updateU16)(update);
}
BrickChange updateBrick(const BrickUpdate<float>& update) {
  return HWY_DYNAMIC_DISPATCH(updateF32)(update);
}

}  // namespace kairos

#endif  // HWY_ONCE
