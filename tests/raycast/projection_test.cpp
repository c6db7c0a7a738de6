// Maximum intensity and average projections against brute force.
#include <gtest/gtest.h>

#include <cmath>

#include "raycast/cast_frame.h"

namespace kairos {
namespace {

RenderSettings projection(const test::Scene& scene, const char* camera, RenderMode mode) {
  RenderSettings settings =
      test::settingsFor(scene, camera, test::softTransferFunction(scene.lattice.type), 22, 19);
  settings.mode = mode;
  return settings;
}

// Every kernel's raw projection against the maximum or sum over all samples of each ray.
void expectBruteForce(const test::Scene& scene, const RenderSettings& settings) {
  const test::Caster caster(scene, settings);
  const auto expected = test::castFieldDirectly(scene, settings);
  const std::vector<int> counts = caster.sampleCounts();
  const double tolerance = 2e-6 * test::fullScale(scene.lattice.type);
  int hit = 0;
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (size_t p = 0; p < counts.size(); ++p) {
      if (counts[p] == 0) continue;
      ++hit;
      const double unit = settings.mode == RenderMode::average ? counts[p] : 1;
      ASSERT_NEAR(double(frame.pixels[p]) / unit, expected[p] / unit, tolerance)
          << scene.name << " " << kernel.name << " pixel " << p;
    }
  }
  EXPECT_GT(hit, 0);
}

TEST(MaximumProjection, IsTheLargestSampleOfEachRay) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : test::allScenes(type))
      for (const char* camera : {"iso", "inside", "close"})
        expectBruteForce(scene, projection(scene, camera, RenderMode::mip));
}

TEST(AverageProjection, IsTheMeanOfEachRaysSamples) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : test::allScenes(type))
      for (const char* camera : {"iso", "inside", "close"})
        expectBruteForce(scene, projection(scene, camera, RenderMode::average));
}

// Values that never reach the background: the background stands for nothing that a ray inside dense data
// meets.
test::Scene belowBackground() {
  test::Scene scene{"negative", test::denseLattice(ElementType::f32, {40, 33, 20}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return -2 - test::whiteNoise(v, 4); });
  return scene;
}

TEST(MaximumProjection, OfDenseDataBelowTheBackgroundIsBelowTheBackground) {
  const auto scene = belowBackground();
  for (const char* camera : {"iso", "inside", "close"})
    expectBruteForce(scene, projection(scene, camera, RenderMode::mip));
}

TEST(MaximumProjection, CountsTheBackgroundWhereDenseDataHoldsIt) {
  auto scene = belowBackground();
  scene.field = test::sampledField(
      scene.lattice, [](const Vec3i& v) { return v.x < 20 ? -2 - test::whiteNoise(v, 4) : 0.0; });
  for (const char* camera : {"iso", "x", "-y"})
    expectBruteForce(scene, projection(scene, camera, RenderMode::mip));
}

TEST(AverageProjection, OfDenseDataBelowTheBackgroundIsItsMean) {
  const auto scene = belowBackground();
  for (const char* camera : {"iso", "inside"})
    expectBruteForce(scene, projection(scene, camera, RenderMode::average));
}

TEST(Projections, OfConstantDataAreThatConstant) {
  const auto scene = test::constantScene(ElementType::u16, {33, 20, 18}, 0.4);
  for (RenderMode mode : {RenderMode::mip, RenderMode::average}) {
    const test::Caster caster(scene, projection(scene, "iso", mode));
    const std::vector<int> counts = caster.sampleCounts();
    for (const auto& kernel : caster.kernels()) {
      const auto frame = caster.cast(kernel);
      for (size_t p = 0; p < counts.size(); ++p) {
        if (counts[p] == 0) continue;
        const float value = mode == RenderMode::mip ? frame.pixels[p] : frame.pixels[p] / float(counts[p]);
        ASSERT_NEAR(value, 26214, 0.05) << kernel.name;
      }
    }
  }
}

}  // namespace
}  // namespace kairos
