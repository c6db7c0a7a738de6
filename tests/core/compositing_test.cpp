#include "core/compositing.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace kairos {
namespace {

TEST(CorrectedOpacity, OverOneUnitIsTheOpacityItself) {
  for (double a : {0.0, 1e-12, 0.01, 0.5, 0.999, 1.0}) EXPECT_DOUBLE_EQ(correctedOpacity(a, 1), a);
}

TEST(CorrectedOpacity, TwoHalfStepsCompositeToOneStep) {
  for (double a : {1e-12, 1e-6, 0.003, 0.25, 0.9, 0.999999})
    for (double d : {0.125, 1.0, 3.7}) {
      const double half = correctedOpacity(a, d / 2), whole = correctedOpacity(a, d);
      EXPECT_NEAR((half + (1 - half) * half) / whole, 1, 1e-12) << a << " over " << d;
    }
}

TEST(CorrectedOpacity, MatchesBeerLambert) {
  for (double opticalDepth : {1e-6, 0.1, 1.0, 30.0}) {
    const double alpha = -std::expm1(-opticalDepth);
    for (double d : {0.125, 0.5, 1.0})
      EXPECT_NEAR(correctedOpacity(alpha, d) / -std::expm1(-opticalDepth * d), 1,
                  1e-3 * (opticalDepth > 20) + 1e-12);
  }
}

TEST(CorrectedOpacity, KeepsPrecisionForTinyOpacities) {
  // 1 - (1 - a)^d evaluated naively loses all digits here.
  EXPECT_NEAR(correctedOpacity(1e-18, 0.25) / 0.25e-18, 1, 1e-12);
  EXPECT_EQ(correctedOpacity(0, 0.25), 0);
}

TEST(CorrectedOpacity, OpaqueStaysOpaqueOverAnyDistanceAboveZero) {
  EXPECT_EQ(correctedOpacity(1, 1e-9), 1);
  EXPECT_EQ(correctedOpacity(1, 100), 1);
  EXPECT_EQ(correctedOpacity(1, 0), 0);
}

using Rgba = std::array<double, 4>;

Rgba composited(Rgba front, const Rgba& back) {
  over<4>(front.data(), back.data());
  return front;
}

TEST(Over, MatchesPorterAndDuff) {
  const Rgba c = composited({0.1, 0.2, 0.3, 0.5}, {0.4, 0.2, 0.0, 0.8});
  EXPECT_DOUBLE_EQ(c[0], 0.1 + 0.5 * 0.4);
  EXPECT_DOUBLE_EQ(c[1], 0.2 + 0.5 * 0.2);
  EXPECT_DOUBLE_EQ(c[2], 0.3);
  EXPECT_DOUBLE_EQ(c[3], 0.5 + 0.5 * 0.8);
}

TEST(Over, TransparentIsNeutralOnBothSides) {
  const Rgba colour{0.1, 0.2, 0.3, 0.5}, clear{};
  EXPECT_EQ(composited(colour, clear), colour);
  EXPECT_EQ(composited(clear, colour), colour);
}

TEST(Over, OpaqueHidesWhatLiesBehind) {
  EXPECT_EQ(composited({0.1, 0.2, 0.3, 1}, {0.9, 0.9, 0.9, 1}), (Rgba{0.1, 0.2, 0.3, 1}));
}

TEST(Over, IsAssociativeToRounding) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto sample = [&] {
    const double a = uniform(random);
    return Rgba{a * uniform(random), a * uniform(random), a * uniform(random), a};
  };
  for (int i = 0; i < 1000; ++i) {
    const Rgba a = sample(), b = sample(), c = sample();
    const Rgba left = composited(composited(a, b), c), right = composited(a, composited(b, c));
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(left[k], right[k], 1e-15);
  }
}

TEST(Over, CompositesFurtherChannelsLikeColours) {
  std::array<float, 5> front{0.25f, 0, 0, 0.5f, 3};
  const std::array<float, 5> back{0, 0.5f, 0, 1, 8};
  over<5>(front.data(), back.data());
  EXPECT_EQ(front, (std::array<float, 5>{0.25f, 0.25f, 0, 1, 7}));
}

}  // namespace
}  // namespace kairos
