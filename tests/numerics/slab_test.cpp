// Images with a known answer: homogeneous matter.
#include <gtest/gtest.h>

#include <cmath>

#include "core/compositing.h"
#include "raycast/cast_frame.h"

namespace kairos {
namespace {

constexpr double kThickness = 16;  // between the outermost centres of 17 voxels

TransferFunction homogeneous(double opacity, const Vec3d& colour = {1, 1, 1}) {
  return {{{0, colour}}, {{0, opacity}, {1, opacity}}};
}

// Parallel rays along -z through a slab that they enter 4 units from their start.
struct Slab {
  test::Scene scene = test::constantScene(ElementType::f32, {17, 17, 17}, 0.5);
  RenderSettings settings;

  explicit Slab(const TransferFunction& tf) {
    settings = test::settingsFor(scene, "orthoZ", tf, 7, 6);
    settings.camera.eye = {8, 8, 20};
    settings.camera.target = {8, 8, 0};
    settings.camera.imageHeight = 8;
    settings.terminate = 1;
  }
};

double relative(double found, double expected) {
  return std::abs(found - expected) / expected;
}

// Both the reference and every kernel show `alpha` and, premultiplied, `colour` in every pixel.
void expectUniform(const test::Scene& scene, const RenderSettings& settings, double alpha,
                   const Vec3d& colour) {
  const test::Caster caster(scene, settings);
  const std::vector<double> reference = caster.reference();
  const double expected[] = {colour.x * alpha, colour.y * alpha, colour.z * alpha, alpha};
  for (size_t i = 0; i < reference.size(); ++i)
    ASSERT_LE(relative(reference[i], expected[i % 4]), 1e-5) << "reference";
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (size_t i = 0; i < frame.pixels.size(); ++i)
      ASSERT_LE(relative(double(frame.pixels[i]), expected[i % 4]), 1e-5) << kernel.name;
  }
}

TEST(HomogeneousSlab, FollowsBeerLambertForEveryOpticalDepthAndStep) {
  const Vec3d colour{0.9, 0.3, 0.6};
  for (double depth : {1e-6, 1e-4, 0.01, 0.3, 1.0, 4.0, 12.0, 50.0})
    for (double step : {0.125, 0.25, 0.5, 1.0, 2.0}) {
      Slab slab(homogeneous(-std::expm1(-depth / kThickness), colour));
      slab.settings.step = step;
      expectUniform(slab.scene, slab.settings, -std::expm1(-depth), colour);
      if (HasFatalFailure()) FAIL() << "optical depth " << depth << ", step " << step;
    }
}

TEST(HomogeneousSlab, FollowsBeerLambertInWorldUnits) {
  // Voxels 0.2 x 0.2 x 0.5 wide; the opacity is meant over 0.75 world units.
  Slab slab(homogeneous(0.07));
  slab.scene.lattice.worldFromIndex = Affine::scale({0.2, 0.2, 0.5});
  slab.settings.camera.eye = {1.6, 1.6, 8 + 2};
  slab.settings.camera.target = {1.6, 1.6, 0};
  slab.settings.camera.imageHeight = 1;
  slab.settings.unitDistance = 0.75;
  slab.settings.step = 0.5;  // 0.1 world units
  expectUniform(slab.scene, slab.settings, correctedOpacity(0.07, 8 / 0.75), {1, 1, 1});
}

TEST(HomogeneousSlab, CountsOnlyWhatLiesBeforeTheEyePlane) {
  for (double z : {12.0, 4.0, 15.0}) {
    Slab slab(homogeneous(0.1));
    slab.settings.camera.eye = {8, 8, z};
    expectUniform(slab.scene, slab.settings, correctedOpacity(0.1, z), {1, 1, 1});
  }
  Slab behind(homogeneous(0.1));
  behind.settings.camera.eye = {8, 8, -1};
  behind.settings.camera.target = {8, 8, -20};
  const test::Caster caster(behind.scene, behind.settings);
  for (float v : caster.cast().pixels) EXPECT_EQ(v, 0.0f);
}

TEST(HomogeneousSlab, IsCutByTheClipBox) {
  for (const auto& [lo, hi] : {std::pair(4.0, 12.0), {-50.0, 3.0}, {9.0, 99.0}}) {
    Slab slab(homogeneous(0.1));
    slab.settings.clipBox = PointBox{{-50, -50, lo}, {50, 50, hi}};
    expectUniform(slab.scene, slab.settings, correctedOpacity(0.1, std::min(hi, 16.0) - std::max(lo, 0.0)),
                  {1, 1, 1});
  }
}

TEST(HomogeneousSlab, EveryRayOfAPerspectiveViewCountsItsOwnSamples) {
  const auto scene = test::constantScene(ElementType::u8, {40, 21, 33}, 0.4);
  for (const char* camera : {"iso", "inside", "wide", "grazing"}) {
    RenderSettings settings = test::settingsFor(scene, camera, homogeneous(0.02));
    settings.transferFunction = TransferFunction({{0, {1, 1, 1}}}, {{0, 0.02}, {255, 0.02}});
    settings.terminate = 1;
    const test::Caster caster(scene, settings);
    const std::vector<int> counts = caster.sampleCounts();
    int hit = 0;
    for (const auto& kernel : caster.kernels()) {
      const auto frame = caster.cast(kernel);
      for (size_t p = 0; p < counts.size(); ++p) {
        hit += counts[p] > 0;
        ASSERT_NEAR(frame.pixel(p)[3], correctedOpacity(0.02, counts[p]), 2e-6) << camera << " pixel " << p;
      }
    }
    EXPECT_GT(hit, 100) << camera;
  }
}

TEST(WhiteFurnace, WhiteMatterShowsExactlyItsOpacity) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : {test::plume(type), test::denseNoise(type)})
      for (float terminate : {1.0f, 0.999f, 0.5f}) {
        const TransferFunction soft = test::softTransferFunction(type);
        RenderSettings settings =
            test::settingsFor(scene, "iso", TransferFunction({{0, {1, 1, 1}}}, soft.opacityPoints()));
        settings.terminate = terminate;
        const test::Caster caster(scene, settings);
        double seen = 0;
        for (const auto& kernel : caster.kernels()) {
          const auto frame = caster.cast(kernel);
          for (size_t i = 0; i < frame.pixels.size(); i += 4) {
            seen += double(frame.pixels[i + 3]);
            for (size_t c = 0; c < 3; ++c)
              ASSERT_EQ(frame.pixels[i + c], frame.pixels[i + 3]) << scene.name << " " << kernel.name;
          }
        }
        EXPECT_GT(seen, 10);
      }
}

TEST(ConstantColour, IsThatColourTimesTheOpacity) {
  const Vec3d colour{0.8, 0.25, 0.1};
  for (ElementType type : test::kAllTypes) {
    const auto scene = test::plume(type);
    for (const auto& tf : test::allTransferFunctions(type)) {
      const TransferFunction tinted({{0, colour}}, tf.function.opacityPoints());
      const test::Caster caster(scene, test::settingsFor(scene, "close", tinted));
      for (const auto& kernel : caster.kernels()) {
        const auto frame = caster.cast(kernel);
        for (size_t i = 0; i < frame.pixels.size(); i += 4)
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(frame.pixels[i + size_t(c)], float(colour[c]) * frame.pixels[i + 3], 2e-6)
                << tf.name << " " << kernel.name;
      }
    }
  }
}

}  // namespace
}  // namespace kairos
