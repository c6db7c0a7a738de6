// Samples and gradients of the Marschner-Lobb signal (1994), the sharpest test of reconstruction there is.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "numerics/field_oracle.h"
#include "raycast/scalar_sampling.h"

namespace kairos {
namespace {

constexpr double kPi = std::numbers::pi, kAlpha = 0.25, kFrequency = 6;

// The signal of support/scenes.h on [-1, 1]^3, and its gradient.
double signal(const Vec3d& p) {
  const double r = std::hypot(p.x, p.y);
  const double rho = std::cos(2 * kPi * kFrequency * std::cos(kPi * r / 2));
  return (1 - std::sin(kPi * p.z / 2) + kAlpha * (1 + rho)) / (2 * (1 + kAlpha));
}

Vec3d signalGradient(const Vec3d& p) {
  const double r = std::hypot(p.x, p.y), scale = 1 / (2 * (1 + kAlpha));
  const double phase = 2 * kPi * kFrequency * std::cos(kPi * r / 2);
  const double alongR = kAlpha * std::sin(phase) * 2 * kPi * kFrequency * std::sin(kPi * r / 2) * kPi / 2;
  return Vec3d{r > 0 ? alongR * p.x / r : 0, r > 0 ? alongR * p.y / r : 0,
               -std::cos(kPi * p.z / 2) * kPi / 2} *
         scale;
}

// One sample a ray, `edge` voxels an axis: the ray's maximum is the sample itself.
RenderSettings oneSampleARay(const test::Scene& scene, int edge, double depth, int pixels) {
  const double middle = 0.5 * (edge - 1);
  RenderSettings settings =
      test::fromAbove(scene, test::homogeneous(0.5), {middle, middle, edge + 3 + 0.5}, 0.9 * edge, pixels);
  settings.mode = RenderMode::mip;
  const double z = edge + 3 - std::floor(depth * edge);
  settings.clipBox = PointBox{{-1e3, -1e3, z - 0.1}, {1e3, 1e3, z + 0.1}};
  return settings;
}

TEST(MarschnerLobb, SamplesAreItsTrilinearValues) {
  for (ElementType type : test::kAllTypes) {
    const test::Scene scene = test::marschnerLobb(type, 41);
    for (double depth : {0.2, 0.5, 0.8}) {
      RenderSettings settings = oneSampleARay(scene, 41, depth, 30);
      // Not along an axis, so that all three fractions count.
      settings.camera.eye = settings.camera.eye + Vec3d{0.3, 0.21, 0.37};
      settings.camera.target = settings.camera.target + Vec3d{0.36, 0.17, 0.37};
      const test::Caster caster(scene, settings);
      for (int count : caster.sampleCounts()) ASSERT_LE(count, 1);
      const auto expected = test::castFieldDirectly(scene, settings);
      // The signal rises by less than 0.6 from voxel to voxel; seven roundings of float interpolation follow.
      const double tolerance = test::fullScale(type) * (3 * 0.6 * test::kPositionError + 7 * 0x1p-24);
      for (const auto& kernel : caster.kernels()) {
        const auto frame = caster.cast(kernel);
        for (size_t i = 0; i < expected.size(); ++i)
          if (double(frame.pixels[i]) != expected[i]) {
            ASSERT_NEAR(double(frame.pixels[i]), expected[i], tolerance) << kernel.name << " pixel " << i;
          }
      }
    }
  }
}

TEST(MarschnerLobb, SamplesApproachTheSignalWithTheSquareOfTheGrid) {
  std::array<double, 2> errors{};
  for (size_t i = 0; i < 2; ++i) {
    const int edge = (64 << i) + 1;
    const test::Scene scene = test::marschnerLobb(ElementType::f32, edge);
    const RenderSettings settings = oneSampleARay(scene, edge, 0.4, 40);
    const test::Caster caster(scene, settings);
    const auto frame = caster.cast();
    const RayGenerator generator(settings.camera, 40, 40);
    const double z = 0.5 * (settings.clipBox->lo.z + settings.clipBox->hi.z);
    double sum = 0;
    for (int p = 0; p < 1600; ++p) {
      const Ray ray = generator.ray(p % 40 + 0.5, p / 40 + 0.5);
      const Vec3d at = Vec3d{ray.origin.x, ray.origin.y, z} * (2.0 / (edge - 1)) - Vec3d{1, 1, 1};
      sum += std::pow(double(frame.pixels[size_t(p)]) - signal(at), 2);
    }
    errors[i] = std::sqrt(sum / 1600);
  }
  EXPECT_GE(std::log2(errors[0] / errors[1]), 1.9) << errors[0] << " " << errors[1];
  EXPECT_LT(errors[1], 0.005);
}

TEST(MarschnerLobb, GradientsApproachTheSignalsWithTheSquareOfTheGrid) {
  std::array<double, 2> errors{};
  for (size_t i = 0; i < 2; ++i) {
    const int edge = (96 << i) + 1;
    const test::Scene scene = test::marschnerLobb(ElementType::f32, edge);
    RenderSettings settings = test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::f32));
    settings.shade = true;
    const test::Caster caster(scene, settings);
    const BrickVolume& volume = caster.volume();
    std::mt19937 random(5);
    // Around the middle, where a grid of 96 resolves the signal's rings.
    std::uniform_real_distribution<double> place(0.33, 0.67);
    double sum = 0;
    for (int n = 0; n < 4000; ++n) {
      const Vec3d unit{place(random), place(random), place(random)};
      const Vec3d index = unit * (edge - 1.0), inGrid = index - Vec3d(volume.gridOrigin());
      const Vec3i cell{int(inGrid.x) / kBrickEdge, int(inGrid.y) / kBrickEdge, int(inGrid.z) / kBrickEdge};
      const Vec3d local = inGrid - Vec3d(cell * kBrickEdge);
      // Footprints start a voxel early here; away from a brick's low faces that changes nothing.
      if (std::min({local.x, local.y, local.z}) < 1) continue;
      const ScalarSampler<float, double> sampler(
          caster.kernelScene(), volume.brick<float>(volume.cellIndex(cell)), {local.x, local.y, local.z});
      const auto found = sampler.gradient();
      const Vec3d exact = signalGradient(unit * 2.0 - Vec3d{1, 1, 1});
      for (int a = 0; a < 3; ++a)
        sum += std::pow(found[size_t(a)] * 0.5 * (edge - 1) - exact[a], 2);  // per unit of the signal's space
    }
    errors[i] = std::sqrt(sum / 4000);
  }
  EXPECT_GE(std::log2(errors[0] / errors[1]), 1.9) << errors[0] << " " << errors[1];
}

}  // namespace
}  // namespace kairos
