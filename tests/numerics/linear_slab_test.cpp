// Matter that varies linearly along the ray: trilinear interpolation is exact, so what is left is the
// sampling's error, which must be the midpoint rule's.
#include <gtest/gtest.h>

#include <cmath>

#include "core/compositing.h"
#include "numerics/field_oracle.h"

namespace kairos {
namespace {

constexpr double kThickness = 16;

// The value falls from 1 at z = 16 (where rays enter) to 0 at z = 0.
test::Scene ramp() {
  test::Scene scene{"ramp", test::denseLattice(ElementType::f32, {9, 9, 17}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return v.z / kThickness; });
  return scene;
}

struct Expected {
  double red, alpha;
};

// Reference and kernels within `tolerance` of red and alpha in every pixel.
void expectColours(const RenderSettings& settings, const Expected& expected, double tolerance) {
  const test::Scene scene = ramp();
  const test::Caster caster(scene, settings);
  const auto check = [&](const auto& pixels, const char* what) {
    for (size_t i = 0; i < pixels.size(); i += 4) {
      ASSERT_NEAR(double(pixels[i]), expected.red, tolerance) << what;
      ASSERT_NEAR(double(pixels[i + 3]), expected.alpha, tolerance) << what;
    }
  };
  check(caster.reference(), "reference");
  for (const auto& kernel : caster.kernels()) check(caster.cast(kernel).pixels, kernel.name);
}

// The midpoint rule is off by h^2 / 24 times the integrand's slope from end to end, the float arithmetic and
// the table's own interpolation by what `--precision full` allows.
double midpointError(double step, double slopeChange) {
  return step * step / 24 * slopeChange + test::kFullPrecision;
}

TEST(LinearSlab, AbsorbsTheIntegralOfItsExtinction) {
  // Opacity a = A v over one unit: the extinction is -ln(1 - A v), and its integral over the slab has the
  // closed form (d / A) ((1 - A) ln(1 - A) + A).
  for (double A : {0.02, 0.3, 0.9})
    for (double step : {0.125, 0.25, 0.5, 1.0}) {
      RenderSettings settings =
          test::fromAbove(ramp(), {{{0, {1, 1, 1}}}, {{0, 0}, {1, A}}}, {4, 4, 20}, 6, 7);
      settings.step = step;
      const double depth = kThickness / A * ((1 - A) * std::log1p(-A) + A);
      const double slope = A / kThickness, slopeChange = slope / (1 - A) - slope;
      // An error of the optical depth weighs e^-depth in the opacity.
      expectColours(settings, {-std::expm1(-depth), -std::expm1(-depth)},
                    midpointError(step, slopeChange * std::exp(-depth)));
      if (HasFatalFailure()) FAIL() << "A " << A << ", step " << step;
    }
}

TEST(LinearSlab, EmitsTheIntegralOfItsColour) {
  // Constant extinction s, red = v: the integral of (1 - x/d) s e^(-s x) is 1 - (1 - e^(-s d)) / (s d).
  for (double opacity : {0.01, 0.1, 0.5})
    for (double step : {0.125, 0.25, 0.5, 1.0}) {
      RenderSettings settings = test::fromAbove(
          ramp(), {{{0, {0, 0, 0}}, {1, {1, 0, 0}}}, {{0, opacity}, {1, opacity}}}, {4, 4, 20}, 6, 7);
      settings.step = step;
      const double s = -std::log1p(-opacity), sd = s * kThickness;
      const double red = 1 - -std::expm1(-sd) / sd;
      // The colour's derivative along the ray, -(1/d + s (1 - x/d)) s e^(-s x), at both ends.
      const double first = (1 / kThickness + s) * s, last = s / kThickness * std::exp(-sd);
      expectColours(settings, {red, -std::expm1(-sd)}, midpointError(step, first - last));
      if (HasFatalFailure()) FAIL() << "opacity " << opacity << ", step " << step;
    }
}

TEST(OpacityInvariance, AnOpacityOverTwiceTheDistanceIsTheSameMatter) {
  // Constant in pieces, so that no table node mixes two opacities the ray sees: values 0 to 16/16, steps
  // between.
  const std::vector<double> opacities{0.02, 0.3, 0.004, 0.7};
  const auto pieces = [&](double distance) {
    std::vector<TransferFunction::OpacityPoint> points;
    for (size_t i = 0; i < opacities.size(); ++i) {
      const double alpha = correctedOpacity(opacities[i], distance);
      points.push_back({double(i) / 4, alpha});
      points.push_back({double(i + 1) / 4, alpha});
    }
    return TransferFunction({{0, {1, 0.4, 0.2}}}, points);
  };
  RenderSettings settings = test::fromAbove(ramp(), pieces(1), {4, 4, 20}, 6, 7);
  const auto once = test::Caster(ramp(), settings).reference();
  for (double unit : {0.25, 3.0, 8.0}) {
    settings.transferFunction = pieces(unit);
    settings.unitDistance = unit;
    const test::Caster caster(ramp(), settings);
    // Table nodes are floats: 16 samples of 2^-24 each.
    EXPECT_LE(test::largestDifference(caster.reference(), once), 16 * 0x1p-24) << unit;
    for (const auto& kernel : caster.kernels())
      EXPECT_LE(test::largestDifference(test::asDoubles(caster.cast(kernel)), once), test::kFullPrecision)
          << unit << " " << kernel.name;
  }
}

TEST(ThinMatter, KeepsAnOpticalDepthOf1e3Over65536Samples) {
  // 1024 voxels at 64 samples a voxel: an opacity of 1.5e-8 each, below the spacing of floats at 1.
  const test::Scene scene = test::constantScene(ElementType::u8, {5, 5, 1025}, 0.4);
  constexpr double kDepth = 1e-3;
  const double opacity = -std::expm1(-kDepth / 1024);
  RenderSettings settings =
      test::fromAbove(scene, {{{0, {1, 1, 1}}}, {{0, opacity}, {255, opacity}}}, {2, 2, 1024 + 2}, 3, 3);
  settings.step = 1.0 / 64;
  const test::Caster caster(scene, settings);
  for (int count : caster.sampleCounts()) ASSERT_EQ(count, 65536);
  const auto check = [&](double found, double tolerance, const char* what) {
    ASSERT_NEAR(found / -std::expm1(-kDepth), 1, tolerance) << what;
  };
  // The table's node is a float: 2^-25. A kernel may lose all attenuation within a segment of 16 voxels,
  // whose optical depth is 1.6e-5, and half of that in its opacity; and it rounds 1024 sums in each of 64
  // segments.
  for (double v : caster.reference()) check(v, 0x1p-24, "reference");
  for (const auto& kernel : caster.kernels())
    for (float v : caster.cast(kernel).pixels) check(double(v), 1e-5, kernel.name);
}

}  // namespace
}  // namespace kairos
