// Pre-integration: exact where the field is linear, of second order up to a dense volume's very faces,
// indifferent to how steep the transfer function is, and the same from every kernel.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "numerics/field_oracle.h"

namespace kairos {
namespace {

// The value falls from 1 at z = 16, where rays enter, to 0 at z = 0.
test::Scene ramp() {
  test::Scene scene{"ramp", test::denseLattice(ElementType::f32, {9, 9, 17}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return v.z / 16.0; });
  return scene;
}

test::Scene smoothMatter() {
  test::Scene scene{"cut", test::denseLattice(ElementType::f32, {24, 24, 24}), {}};
  scene.field = test::sampledField(
      scene.lattice, [](const Vec3i& v) { return 0.2 + 0.6 * test::smoothNoise(Vec3d(v), 9, 4); });
  return scene;
}

std::vector<double> referenceAt(const test::Scene& scene, RenderSettings settings, double step) {
  settings.step = step;
  return test::Caster(scene, settings).reference();
}

TEST(Preintegration, NeedsOneSlabABrickWhereMatterIsHomogeneous) {
  const test::Scene scene = test::constantScene(ElementType::f32, {9, 9, 17}, 0.5);
  for (const double alpha : {0.001, 0.1, 0.9}) {
    RenderSettings settings =
        test::fromAbove(scene, test::homogeneous(alpha, {0.25, 0.5, 1}), {4, 4, 20}, 6, 7);
    settings.preintegrated = true;
    settings.step = 64;
    const test::Caster caster(scene, settings);
    const double expected = -std::expm1(16 * std::log1p(-alpha));
    constexpr double kColour[4] = {0.25, 0.5, 1, 1};
    for (const auto& kernel : caster.kernels()) {
      const test::CastFrame frame = caster.cast(kernel);
      for (size_t i = 0; i < frame.pixels.size(); i += 4)
        for (size_t c = 0; c < 4; ++c)
          ASSERT_NEAR(frame.pixels[i + c], expected * kColour[c], 2e-6) << kernel.name << ", alpha " << alpha;
    }
  }
}

TEST(Preintegration, AbsorbsALinearSlabsIntegralWithOneSlabABrick) {
  // Opacity A v over one unit: the extinction -ln(1 - A v) has the integral (d / A) ((1 - A) ln(1 - A) + A).
  for (const double A : {0.02, 0.3, 0.9}) {
    RenderSettings settings = test::fromAbove(ramp(), {{{0, {1, 1, 1}}}, {{0, 0}, {1, A}}}, {4, 4, 20}, 6, 7);
    settings.preintegrated = true;
    settings.step = 64;
    const test::Scene scene = ramp();
    const test::Caster caster(scene, settings);
    const double expected = -std::expm1(-16 / A * ((1 - A) * std::log1p(-A) + A));
    // The table joins its 256 nodes by straight lines: h^2 / 12 times the change of slope, 16 voxels deep.
    const double tableError = 16 * A / 12 / (255.0 * 255.0) * (A / (1 - A)) + 1e-6;
    for (const auto& kernel : caster.kernels()) {
      const test::CastFrame frame = caster.cast(kernel);
      for (size_t i = 3; i < frame.pixels.size(); i += 4)
        ASSERT_NEAR(frame.pixels[i], expected, tableError) << kernel.name << ", A " << A;
    }
  }
}

TEST(Preintegration, IsOfSecondOrderWhereFacesCutMatter) {
  const test::Scene scene = smoothMatter();
  RenderSettings settings =
      test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::f32), 24, 24);
  settings.terminate = 1;
  settings.preintegrated = true;
  const auto finest = referenceAt(scene, settings, 1.0 / 64);
  const double coarse = test::rootMeanSquareDifference(referenceAt(scene, settings, 1), finest),
               fine = test::rootMeanSquareDifference(referenceAt(scene, settings, 0.25), finest);
  EXPECT_GE(0.5 * std::log2(coarse / fine), 1.9) << coarse << " " << fine;
  settings.preintegrated = false;
  const double classified = test::rootMeanSquareDifference(referenceAt(scene, settings, 1), finest);
  EXPECT_LT(20 * coarse, classified);
}

TEST(Preintegration, ConvergesToWhatPostClassificationConvergesTo) {
  const test::Scene scene = test::plume(ElementType::f32, 32);
  RenderSettings settings =
      test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::f32), 20, 20);
  settings.terminate = 1;
  const auto classified = referenceAt(scene, settings, 1.0 / 64);
  settings.preintegrated = true;
  EXPECT_LT(test::rootMeanSquareDifference(referenceAt(scene, settings, 1.0 / 16), classified), 1e-4);
}

TEST(Preintegration, IsIndifferentToHowSteepTheTransferFunctionIs) {
  const test::Scene scene = smoothMatter();
  RenderSettings settings =
      test::settingsFor(scene, "iso", test::windowedTransferFunction(ElementType::f32), 24, 24);
  settings.terminate = 1;
  const auto classified = referenceAt(scene, settings, 1);
  settings.preintegrated = true;
  const auto finest = referenceAt(scene, settings, 1.0 / 64);
  const double before = test::rootMeanSquareDifference(classified, finest),
               now = test::rootMeanSquareDifference(referenceAt(scene, settings, 1), finest);
  EXPECT_LT(10 * now, before) << now << " " << before;
}

// Kernels within 1e-5 of the reference.
void expectKernelsMatch(const test::Scene& scene, const RenderSettings& settings, const std::string& what) {
  const test::Caster caster(scene, settings);
  const std::vector<double> reference = caster.reference();
  for (const auto& kernel : caster.kernels()) {
    const test::Deviation d = test::deviation(caster, caster.cast(kernel), reference);
    EXPECT_LE(d.largest, 1e-5) << what << " " << kernel.name;
  }
}

TEST(Preintegration, IsTheSameFromEveryKernel) {
  size_t turn = 0;
  for (const ElementType type : test::kAllTypes)
    for (const test::Scene& scene : test::allScenes(type))
      for (const std::string& camera : test::cameraNames()) {
        const auto functions = test::allTransferFunctions(type);
        const auto& tf = functions[turn % functions.size()];
        RenderSettings settings = test::settingsFor(scene, camera, tf.function, 39, 36);
        settings.preintegrated = true;
        settings.step = std::array{1.0, 0.37, 1.6, 4.0, 0.125}[turn % 5];
        if (turn % 7 == 0) {
          const PointBox world = scene.lattice.worldBounds();
          settings.clipBox = PointBox{world.lo + (world.hi - world.lo) * 0.23, world.hi};
        }
        ++turn;
        expectKernelsMatch(scene, settings,
                           scene.name + " " + camera + " " + tf.name + " " + name(type).data());
      }
}

TEST(ErrorDriven, IsTheSameFromEveryKernel) {
  for (const ElementType type : test::kAllTypes)
    for (const test::Scene& scene : {test::plume(type), test::denseNoise(type)})
      for (const char* camera : {"iso", "close", "wide"})
        for (const double error : {1e-2, 1e-4}) {
          RenderSettings settings =
              test::settingsFor(scene, camera, test::softTransferFunction(type), 39, 36);
          settings.error = error;
          expectKernelsMatch(scene, settings, scene.name + " " + camera + " " + name(type).data());
        }
}

TEST(ErrorDriven, KeepsWithinItsTarget) {
  std::vector<test::Scene> scenes{smoothMatter(), test::jet1(40), test::jet1(90)};
  for (const ElementType type : {ElementType::u8, ElementType::f32}) {
    scenes.push_back(test::plume(type));
    scenes.push_back(test::marschnerLobb(type));
  }
  for (const test::Scene& scene : scenes)
    for (const auto& tf : test::allTransferFunctions(scene.lattice.type)) {
      if (std::string(tf.name) == "opaque") continue;
      RenderSettings settings = test::settingsFor(scene, "iso", tf.function, 64, 64);
      RenderSettings finest = settings;
      finest.preintegrated = true;
      finest.step = 1.0 / 64;
      const auto converged = test::Caster(scene, finest).reference();
      for (const double error : {1e-2, 1e-3, 1e-4}) {
        settings.error = error;
        const test::CastFrame frame = test::Caster(scene, settings).cast();
        EXPECT_LE(test::rootMeanSquareDifference(test::asDoubles(frame), converged), error)
            << scene.name << " " << tf.name;
      }
    }
}

TEST(ErrorDriven, SpendsOneSlabOnHomogeneousBricks) {
  const test::Scene scene = test::constantScene(ElementType::f32, {48, 48, 48}, 0.5);
  RenderSettings settings = test::settingsFor(scene, "iso", test::homogeneous(0.01), 96, 96);
  settings.error = 1e-4;
  const test::CastFrame few = test::Caster(scene, settings).cast();
  settings.error = 0;
  const test::CastFrame many = test::Caster(scene, settings).cast();
  EXPECT_LT(2 * few.counters.samples, many.counters.samples);
}

}  // namespace
}  // namespace kairos
