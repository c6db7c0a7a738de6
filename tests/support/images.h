// Comparing images in tests.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "core/image.h"

namespace kairos::test {

/// Success when both images have the same size and the same bits; otherwise names the first pixel that
/// differs, its values, and how many pixels do.
inline testing::AssertionResult imagesEqualBitForBit(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels)
    return testing::AssertionFailure() << a.width << "x" << a.height << "x" << a.channels << " against "
                                       << b.width << "x" << b.height << "x" << b.channels;
  int64_t differing = 0;
  testing::AssertionResult failure = testing::AssertionFailure();
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int c = 0; c < a.channels; ++c) {
        const float p = a.pixel(x, y)[c], q = b.pixel(x, y)[c];
        if (std::bit_cast<uint32_t>(p) == std::bit_cast<uint32_t>(q)) continue;
        if (differing++ == 0)
          failure << "first difference at pixel (" << x << ", " << y << ") channel " << c << ": " << p
                  << " against " << q << ", by " << p - q;
        break;
      }
  if (differing == 0) return testing::AssertionSuccess();
  return failure << "; " << differing << " pixels differ";
}

}  // namespace kairos::test
