// Axes: their ends, their ticks, and where values stand.
#include "plot/scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace kairos::plot {
namespace {

std::vector<std::string> labels(const Scale& scale) {
  std::vector<std::string> all;
  for (const Tick& tick : scale.ticks())
    if (!tick.label.empty()) all.push_back(tick.label);
  return all;
}

TEST(Scale, LinearEnclosesTheRangeByRoundSteps) {
  const Scale scale = Scale::linear(0.3, 9.2);
  EXPECT_EQ(scale.lo(), 0);
  EXPECT_EQ(scale.hi(), 10);
  EXPECT_EQ(labels(scale), (std::vector<std::string>{"0", "2", "4", "6", "8", "10"}));
}

TEST(Scale, LinearLabelsHaveTheDecimalsOfTheStep) {
  EXPECT_EQ(labels(Scale::linear(-0.1, 0.15)),
            (std::vector<std::string>{"-0.10", "-0.05", "0.00", "0.05", "0.10", "0.15"}));
}

TEST(Scale, LinearOfOneValueStillHasWidth) {
  const Scale scale = Scale::linear(7, 7);
  EXPECT_LE(scale.lo(), 7);
  EXPECT_GT(scale.hi(), scale.lo());
}

TEST(Scale, RoundEndsStayWhereTheyAre) {
  for (const double hi : {1.0, 2.0, 50.0, 0.001, 1e-7}) {
    EXPECT_DOUBLE_EQ(Scale::linear(0, hi).hi(), hi);
    EXPECT_DOUBLE_EQ(Scale::logarithmic(hi / 1000, hi).hi(), hi);
    EXPECT_DOUBLE_EQ(Scale::logarithmic(hi, hi * 1000).lo(), hi);
  }
}

TEST(Scale, LogarithmicLabelsOneTwoFiveOverAFewDecades) {
  const Scale scale = Scale::logarithmic(1.3, 43);
  EXPECT_EQ(scale.lo(), 1);
  EXPECT_EQ(scale.hi(), 50);
  EXPECT_EQ(labels(scale), (std::vector<std::string>{"1", "2", "5", "10", "20", "50"}));
}

TEST(Scale, LogarithmicLabelsPowersOverManyDecades) {
  EXPECT_EQ(labels(Scale::logarithmic(1e-5, 1)),
            (std::vector<std::string>{"10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "1"}));
}

TEST(Scale, PositionsRunFromZeroToOne) {
  const Scale linear = Scale::linear(0, 10), logarithmic = Scale::logarithmic(1, 100);
  EXPECT_DOUBLE_EQ(linear.position(2.5), 0.25);
  EXPECT_DOUBLE_EQ(logarithmic.position(10), 0.5);
  for (const Scale& scale : {linear, logarithmic}) {
    EXPECT_DOUBLE_EQ(scale.position(scale.lo()), 0);
    EXPECT_DOUBLE_EQ(scale.position(scale.hi()), 1);
  }
}

TEST(Scale, ValuesOutsideStandAtTheNearerEnd) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Scale linear = Scale::linear(0, 10), logarithmic = Scale::logarithmic(1, 100);
  for (const Scale& scale : {linear, logarithmic}) {
    EXPECT_EQ(scale.position(-3), 0);
    EXPECT_EQ(scale.position(kInfinity), 1);
  }
  EXPECT_EQ(logarithmic.position(0), 0);
}

TEST(Scale, AutomaticIsLogarithmicOnlyForWideRangesAboveZero) {
  EXPECT_TRUE(Scale::automatic(1, 100).isLogarithmic());
  EXPECT_FALSE(Scale::automatic(1, 5).isLogarithmic());
  EXPECT_FALSE(Scale::automatic(0, 100).isLogarithmic());
  EXPECT_EQ(Scale::automatic(1, 5).lo(), 0) << "lengths can be compared";
}

TEST(Scale, TicksLieWithinTheEnds) {
  for (const Scale& scale :
       {Scale::linear(-3.7, 812), Scale::logarithmic(3e-6, 7e4), Scale::linear(0.11, 0.12)})
    for (const Tick& tick : scale.ticks()) {
      EXPECT_GE(tick.value, scale.lo() - 1e-9 * std::abs(scale.lo()));
      EXPECT_LE(tick.value, scale.hi() + 1e-9 * std::abs(scale.hi()));
    }
}

TEST(ShortNumber, KeepsTheDigitsAskedForAndNoZeros) {
  EXPECT_EQ(shortNumber(12.3456), "12.35");
  EXPECT_EQ(shortNumber(0.00312), "0.00312");
  EXPECT_EQ(shortNumber(40), "40");
  EXPECT_EQ(shortNumber(123456), "123456");
  EXPECT_EQ(shortNumber(0), "0");
  EXPECT_EQ(shortNumber(2.5e-5), "2.5e-05");
  EXPECT_EQ(shortNumber(std::numeric_limits<double>::infinity()), "∞");
}

}  // namespace
}  // namespace kairos::plot
