#include "core/transfer_function.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"

namespace kairos {
namespace {

using Colours = std::vector<TransferFunction::ColourPoint>;
using Opacities = std::vector<TransferFunction::OpacityPoint>;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const TransferFunction kRamp({{10, {1, 0, 0}}, {20, {0, 0.5, 0}}, {40, {0, 0, 1}}}, {{0, 0}, {50, 1}});

TEST(TransferFunction, InterpolatesColourAndOpacityIndependently) {
  EXPECT_EQ(kRamp.colour(15), (Vec3d{0.5, 0.25, 0}));
  EXPECT_EQ(kRamp.colour(30), (Vec3d{0, 0.25, 0.5}));
  EXPECT_DOUBLE_EQ(kRamp.opacity(15), 0.3);
}

TEST(TransferFunction, PassesThroughItsPoints) {
  for (const auto& p : kRamp.colourPoints()) EXPECT_EQ(kRamp.colour(p.value), p.colour);
  for (const auto& p : kRamp.opacityPoints()) EXPECT_EQ(kRamp.opacity(p.value), p.opacity);
}

TEST(TransferFunction, ExtendsItsEndsOutwards) {
  EXPECT_EQ(kRamp.colour(-1e9), (Vec3d{1, 0, 0}));
  EXPECT_EQ(kRamp.colour(1e9), (Vec3d{0, 0, 1}));
  EXPECT_EQ(kRamp.opacity(-1), 0);
  EXPECT_EQ(kRamp.opacity(51), 1);
}

TEST(TransferFunction, DomainSpansColourAndOpacityPoints) {
  EXPECT_EQ(kRamp.domain(), (ValueRange{0, 50}));
}

TEST(TransferFunction, TwoPointsOfEqualValueMakeAStep) {
  const TransferFunction tf({{0, {1, 1, 1}}}, {{0, 0}, {5, 0}, {5, 0.75}, {9, 0.75}});
  EXPECT_EQ(tf.opacity(std::nextafter(5.0, 0.0)), 0);
  EXPECT_EQ(tf.opacity(5), 0.75) << "at the step the later point wins";
  EXPECT_EQ(tf.opacity(6), 0.75);
}

TEST(TransferFunction, OnePointIsAConstant) {
  const TransferFunction tf({{3, {0.1, 0.2, 0.3}}}, {{3, 0.5}});
  for (double v : {-10.0, 3.0, 10.0}) {
    EXPECT_EQ(tf.colour(v), (Vec3d{0.1, 0.2, 0.3}));
    EXPECT_EQ(tf.opacity(v), 0.5);
  }
}

TEST(TransferFunction, StretchedKeepsItsShape) {
  const TransferFunction stretched = kRamp.stretchedTo({-1, 1});
  EXPECT_EQ(stretched.domain(), (ValueRange{-1, 1}));
  for (double f : {0.0, 0.1, 0.31, 0.5, 0.99, 1.0}) {
    EXPECT_NEAR(stretched.opacity(-1 + 2 * f), kRamp.opacity(50 * f), 1e-12);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(stretched.colour(-1 + 2 * f)[c], kRamp.colour(50 * f)[c], 1e-12);
  }
}

TEST(TransferFunction, StretchingKeepsSteps) {
  const TransferFunction tf =
      TransferFunction({{0, {1, 1, 1}}}, {{0, 0}, {0.5, 0}, {0.5, 1}, {1, 1}}).stretchedTo({0, 200});
  EXPECT_EQ(tf.opacity(99.999), 0);
  EXPECT_EQ(tf.opacity(100), 1);
}

TEST(TransferFunction, StretchingAConstantStaysDefined) {
  const TransferFunction tf = TransferFunction({{3, {1, 1, 1}}}, {{3, 0.5}}).stretchedTo({10, 20});
  EXPECT_EQ(tf.opacity(15), 0.5);
  EXPECT_EQ(tf.domain().lo, 10);
}

TEST(TransferFunction, StretchingToASingleValueKeepsItsPointsSorted) {
  const TransferFunction tf = kRamp.stretchedTo({7, 7});
  EXPECT_EQ(tf.domain(), (ValueRange{7, 7}));
  EXPECT_EQ(tf.opacity(8), 1);
  EXPECT_EQ(tf.opacity(6), 0);
}

void expectRefused(const Colours& colours, const Opacities& opacities, const std::string& saying) {
  try {
    TransferFunction(colours, opacities);
    ADD_FAILURE() << "accepted, expected: " << saying;
  } catch (const OptionError& e) {
    EXPECT_THAT(e.what(), HasSubstr(saying));
  }
}

TEST(TransferFunction, RefusesWhatIsNoFunction) {
  const Colours white{{0, {1, 1, 1}}};
  const Opacities half{{0, 0.5}};
  expectRefused({}, half, "no colour points");
  expectRefused(white, {}, "no opacity points");
  expectRefused({{1, {}}, {0, {}}}, half, "colour point 1");
  expectRefused(white, {{0, 0}, {2, 0}, {1, 0}}, "opacity point 2");
  expectRefused({{kNan, {}}}, half, "colour point 0");
  expectRefused(white, {{kInfinity, 0}}, "opacity point 0");
  expectRefused({{0, {0, -0.1, 0}}}, half, "-0.1");
  expectRefused({{0, {0, kNan, 0}}}, half, "expected a number >= 0");
  expectRefused({{0, {0, kInfinity, 0}}}, half, "expected a number >= 0");
  expectRefused(white, {{0, 1.5}}, "1.5");
  expectRefused(white, {{0, -0.01}}, "expected a number in [0, 1]");
  expectRefused(white, {{0, kNan}}, "expected a number in [0, 1]");
}

TEST(TransferFunction, AcceptsColoursAboveOne) {
  EXPECT_NO_THROW(TransferFunction({{0, {12, 3, 1}}}, {{0, 0.1}}));
}

}  // namespace
}  // namespace kairos
