#include "core/srgb.h"

#include <gtest/gtest.h>

#include <limits>

namespace kairos {
namespace {

TEST(Srgb, MatchesTheStandard) {
  EXPECT_EQ(srgbFromLinear(0), 0);
  EXPECT_NEAR(srgbFromLinear(1), 1, 1e-15);
  EXPECT_NEAR(srgbFromLinear(0.5), 0.7353569831, 1e-9);
  EXPECT_NEAR(linearFromSrgb(0.5), 0.2140411405, 1e-9);
  EXPECT_NEAR(srgbFromLinear(0.001), 0.01292, 1e-15);
}

TEST(Srgb, EncodingAndDecodingAreInverses) {
  for (int i = 0; i <= 1000; ++i)
    EXPECT_NEAR(linearFromSrgb(srgbFromLinear(i / 1000.0)), i / 1000.0, 1e-6) << i;
}

TEST(Srgb, DisplayClipsAndShowsNanAsBlack) {
  EXPECT_EQ(displayed(0.25f), 0.25);
  EXPECT_EQ(displayed(-0.1f), 0);
  EXPECT_EQ(displayed(7.0f), 1);
  EXPECT_EQ(displayed(std::numeric_limits<float>::infinity()), 1);
  EXPECT_EQ(displayed(std::numeric_limits<float>::quiet_NaN()), 0);
}

}  // namespace
}  // namespace kairos
