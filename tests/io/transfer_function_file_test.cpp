#include "io/transfer_function_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/srgb.h"
#include "io/paraview_colour.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::HasSubstr;

TransferFunction parse(const std::string& text) {
  const test::TemporaryDirectory directory;
  return readTransferFunction(directory.write("tf", text));
}

std::string problemOf(const std::string& text) {
  return test::messageOf<InputError>([&] { parse(text); });
}

void expectColour(const Vec3d& linear, const DisplayColour& display, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(linear[c], linearFromSrgb(display[size_t(c)]), tolerance);
}

std::string blueToRed(const std::string& space) {
  return R"([{"ColorSpace": ")" + space + R"(", "Name": "x", "RGBPoints": [0, 0, 0, 1, 10, 1, 0, 0]}])";
}

TEST(TransferFunctionRows, AreLinearAndTakenAsTheyAre) {
  const TransferFunction tf = parse("# value r g b a\n0 0 0 0 0\n\n2, 1, 0.5, 0, 0.8  # hot\n");
  EXPECT_EQ(tf.colour(1), (Vec3d{0.5, 0.25, 0}));
  EXPECT_DOUBLE_EQ(tf.opacity(1), 0.4);
}

TEST(TransferFunctionRows, ProblemsNameTheLine) {
  EXPECT_THAT(problemOf("0 0 0 0 0\n1 0 0 0\n"), HasSubstr("line 2"));
  EXPECT_THAT(problemOf("0 0 0 0 0\n1 0 red 0 0\n"), HasSubstr("red"));
  EXPECT_THAT(problemOf("1 0 0 0 0\n0 0 0 0 0\n"), HasSubstr("line 2"));
  EXPECT_THAT(problemOf("0 0 0 0 1.5\n"), HasSubstr("opacity"));
  EXPECT_THAT(problemOf("0 -1 0 0 1\n"), HasSubstr("colour"));
  EXPECT_THAT(problemOf("nan 0 0 0 1\n"), HasSubstr("finite"));
  EXPECT_THAT(problemOf("# nothing\n"), HasSubstr("no row"));
}

TEST(ParaViewColours, RgbIsInterpolatedInDisplaySpace) {
  const TransferFunction tf = parse(blueToRed("RGB"));
  for (double v : {0.0, 1.7, 5.0, 9.9, 10.0}) expectColour(tf.colour(v), {v / 10, 0, 1 - v / 10}, 2e-4);
}

TEST(ParaViewColours, HsvRunsThroughGreenUnlessItWraps) {
  expectColour(parse(blueToRed("HSV")).colour(5), {0, 1, 0}, 1e-6);
  const DisplayColour wrapped =
      interpolateParaViewColour(ParaViewColourSpace::hsvWrapped, {0, 0, 1}, {1, 0, 0}, 0.5);
  EXPECT_NEAR(wrapped[0], 1, 1e-9);
  EXPECT_NEAR(wrapped[1], 0, 1e-9);
  EXPECT_NEAR(wrapped[2], 1, 1e-9);
}

TEST(ParaViewColours, StepTakesTheColourOfTheUpperPoint) {
  const TransferFunction tf = parse(R"({"ColorSpace": "Step", "RGBPoints": [0, 1,0,0, 1, 0,1,0, 2, 0,0,1]})");
  expectColour(tf.colour(0.01), {0, 1, 0}, 1e-12);
  expectColour(tf.colour(0.99), {0, 1, 0}, 1e-12);
  expectColour(tf.colour(1.01), {0, 0, 1}, 1e-12);
}

TEST(ParaViewColours, LabFollowsLightness) {
  // Black to white in Lab at the middle is L = 50: 18.4 % linear, 46.6 % display.
  const TransferFunction tf = parse(R"([{"ColorSpace": "Lab", "RGBPoints": [0, 0,0,0, 1, 1,1,1]}])");
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(tf.colour(0.5)[c], 0.1842, 1e-3);
}

TEST(ParaViewColours, DivergingPassesTheWhiteOfMorelandsCoolToWarm) {
  const TransferFunction tf = parse(
      R"([{"ColorSpace": "Diverging", "RGBPoints": [0, 0.23137, 0.29804, 0.75294, 1, 0.70588, 0.01569, 0.14902]}])");
  expectColour(tf.colour(0.5), {0.865, 0.865, 0.865}, 0.01);  // values published with the map
  expectColour(tf.colour(0.25), {0.5543, 0.6901, 0.9955}, 0.01);
  expectColour(tf.colour(0.75), {0.9567, 0.598, 0.4773}, 0.01);
}

TEST(ParaViewColours, EndPointsAreKeptInEverySpace) {
  for (const char* space : {"RGB", "HSV", "Lab", "CIELAB", "Diverging"}) {
    const TransferFunction tf = parse(blueToRed(space));
    expectColour(tf.colour(0), {0, 0, 1}, 1e-3);
    expectColour(tf.colour(10), {1, 0, 0}, 1e-3);
  }
}

TEST(ParaViewOpacity, MidpointAndSharpnessFollowVtk) {
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0, 1, 0.5, 0, 0.3), 0.3);
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0, 1, 0.25, 0, 0.25), 0.5);
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0, 1, 0.25, 0, 0.125), 0.25);
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0.2, 1, 0.5, 1, 0.49), 0.2);
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0.2, 1, 0.5, 1, 0.5), 1);
  EXPECT_DOUBLE_EQ(interpolateParaViewOpacity(0, 1, 0.5, 0.5, 0.5), 0.5);
  // By hand for sharpness 0.1 at 0.25: s = 0.5 * 0.5^2 = 0.125, Hermite with slope 0.9.
  EXPECT_NEAR(interpolateParaViewOpacity(0, 1, 0.5, 0.1, 0.25),
              0.04296875 + 0.9 * (0.095703125 - 0.013671875), 1e-12);
}

TEST(ParaViewOpacity, PointsAreSampledFinely) {
  const auto file = [](double midpoint, double sharpness) {
    return R"([{"RGBPoints": [0,0,0,0, 1,1,1,1], "Points": [0, 0.1, )" + std::to_string(midpoint) + ", " +
           std::to_string(sharpness) + R"(, 1, 0.9, 0.5, 0]}])";
  };
  for (double midpoint : {0.2, 0.5, 0.8})
    for (double sharpness : {0.0, 0.3, 0.6}) {
      const TransferFunction tf = parse(file(midpoint, sharpness));
      for (double x = 0; x <= 1; x += 0.013)
        EXPECT_NEAR(tf.opacity(x), interpolateParaViewOpacity(0.1, 0.9, midpoint, sharpness, x), 2e-3);
    }
  const TransferFunction step = parse(file(0.5, 1));
  EXPECT_DOUBLE_EQ(step.opacity(0.499), 0.1);
  EXPECT_DOUBLE_EQ(step.opacity(0.501), 0.9);
}

TEST(ParaViewOpacity, WithoutPointsTheDefaultRampSpansTheColours) {
  const TransferFunction tf = parse(blueToRed("RGB"));
  EXPECT_EQ(tf.domain(), (ValueRange{0, 10}));
  EXPECT_EQ(tf.opacity(0), 0);
  EXPECT_GT(tf.opacity(10), 0);
}

TEST(ParaViewJson, ProblemsNameTheEntry) {
  EXPECT_THAT(problemOf("[{"), HasSubstr("JSON"));
  EXPECT_THAT(problemOf("[]"), HasSubstr("RGBPoints"));
  EXPECT_THAT(problemOf(R"([{"IndexedColors": [1,2,3]}])"), HasSubstr("RGBPoints"));
  EXPECT_THAT(problemOf(R"([{"RGBPoints": [0,0,0]}])"), HasSubstr("RGBPoints"));
  EXPECT_THAT(problemOf(R"([{"RGBPoints": [0,0,0,2]}])"), HasSubstr("RGBPoints[3]"));
  EXPECT_THAT(problemOf(R"([{"RGBPoints": [1,0,0,0, 0,1,1,1]}])"), HasSubstr("RGBPoints[4]"));
  EXPECT_THAT(problemOf(R"([{"RGBPoints": [0,0,0,null]}])"), HasSubstr("RGBPoints[3]"));
  EXPECT_THAT(problemOf(R"([{"ColorSpace": "XYZ", "RGBPoints": [0,0,0,0]}])"), HasSubstr("XYZ"));
  EXPECT_THAT(problemOf(R"([{"RGBPoints": [0,0,0,0], "Points": [0,2,0.5,0]}])"), HasSubstr("Points[1]"));
  EXPECT_THROW(readTransferFunction("/nonexistent/tf.json"), InputError);
}

}  // namespace
}  // namespace kairos
