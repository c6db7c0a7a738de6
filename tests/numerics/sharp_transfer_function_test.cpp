// Transfer functions with edges: where the smallest error of a position is the largest of a colour.
#include <gtest/gtest.h>

#include <cmath>

#include "core/compositing.h"
#include "numerics/field_oracle.h"

namespace kairos {
namespace {

// The value falls by 1/16 a voxel along the rays.
test::Scene ramp() {
  test::Scene scene{"ramp", test::denseLattice(ElementType::f32, {9, 9, 17}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return v.z / 16.0; });
  return scene;
}

TransferFunction peak(double at, double halfWidth, double opacity) {
  return {{{0, {1, 0.5, 0.25}}}, {{at - halfWidth, 0}, {at, opacity}, {at + halfWidth, 0}}};
}

TEST(DeltaTransferFunction, ShowsTheIntegralOverItsPeak) {
  // A peak two table nodes wide at either side, of opacity A: the optical depth is the integral of -ln(1 - A
  // u) over u = 0..1, twice, times the half width in voxels.
  for (double A : {0.2, 0.9})
    for (int node : {1000, 2047, 3333}) {
      const double at = node / 4095.0, halfWidth = 2 / 4095.0;
      RenderSettings settings = test::fromAbove(ramp(), peak(at, halfWidth, A), {4, 4, 20}, 6, 7);
      settings.step = 1.0 / 64;
      const test::Caster caster(ramp(), settings);
      ASSERT_EQ(caster.table().nodeCount(), 4096);
      const double depth = 2 * halfWidth * 16 * ((1 - A) * std::log1p(-A) + A) / A;
      const double alpha = -std::expm1(-depth);
      // One sample falls on the peak's 1/64 voxel: the sum differs from the integral by less than the largest
      // term, which is what post-classification can do at this step.
      const double largest = -std::expm1(std::log1p(-A) / 64);
      const auto reference = caster.reference();
      for (size_t i = 3; i < reference.size(); i += 4) ASSERT_NEAR(reference[i], alpha, largest);
      for (const auto& kernel : caster.kernels())
        EXPECT_LE(test::largestDifference(test::asDoubles(caster.cast(kernel)), reference),
                  test::kFullPrecision)
            << kernel.name << ", node " << node;
    }
}

TEST(DeltaTransferFunction, NarrowerThanTheSampleDistanceIsSeenAlikeByEveryKernel) {
  for (const auto& scene : {test::marschnerLobb(ElementType::f32), test::plume(ElementType::f32)})
    for (const char* camera : {"iso", "close", "inside"}) {
      RenderSettings settings = test::settingsFor(scene, camera, peak(0.4, 1 / 4095.0, 0.9));
      settings.terminate = 1;
      const test::Caster caster(scene, settings);
      const auto reference = caster.reference();
      double seen = 0;
      for (double v : reference) seen += v;
      EXPECT_GT(seen, 1);
      // 4095 nodes a unit, 0.9 of opacity from node to node, up to 0.6 of the field from voxel to voxel. Few
      // rays meet more than one such sample; the position's largest error being rare, a third of it is asked.
      const double slope = 4095 * 0.9 * 0.6;
      for (const auto& kernel : caster.kernels())
        EXPECT_LE(test::largestDifference(test::asDoubles(caster.cast(kernel)), reference),
                  slope * test::kPositionError / 3)
            << scene.name << " " << camera << " " << kernel.name;
    }
}

TEST(OpaqueTransferFunction, ShowsTheFirstSampleExactly) {
  for (ElementType type : test::kAllTypes) {
    const test::Scene scene = test::constantScene(type, {17, 17, 17}, 0.5);
    const double scale = test::fullScale(type);
    for (bool depth : {false, true}) {
      RenderSettings settings =
          test::fromAbove(scene, {{{0, {0.25, 0.5, 1}}}, {{0, 1}, {scale, 1}}}, {8, 8, 20}, 8, 9);
      settings.depth = depth;
      settings.step = 0.5;
      const test::Caster caster(scene, settings);
      const size_t channels = size_t(settings.channels());
      for (const auto& kernel : caster.kernels()) {
        const auto frame = caster.cast(kernel);
        for (size_t i = 0; i < frame.pixels.size(); i += channels) {
          ASSERT_EQ(frame.pixels[i], 0.25f) << kernel.name;
          ASSERT_EQ(frame.pixels[i + 1], 0.5f) << kernel.name;
          ASSERT_EQ(frame.pixels[i + 2], 1.0f) << kernel.name;
          ASSERT_EQ(frame.pixels[i + 3], 1.0f) << kernel.name;
          if (depth) {
            ASSERT_EQ(frame.pixels[i + 4], 4.25f) << kernel.name;  // the matter starts 4 below
          }
        }
      }
    }
  }
}

TEST(OpaqueTransferFunction, AnEdgeInTheValueIsAnEdgeInSpaceWithinOneTableNode) {
  // Transparent below one half, opaque above: rays from the transparent side end where the ramp passes it.
  RenderSettings settings =
      test::fromAbove(ramp(), {{{0, {1, 1, 1}}}, {{0, 0}, {0.5, 0}, {0.5, 1}, {1, 1}}}, {4, 4, -4}, 6, 7);
  settings.camera.target = {4, 4, 0};
  settings.depth = true;
  settings.step = 1.0 / 64;
  const test::Caster caster(ramp(), settings);
  const double node = 16.0 / (caster.table().nodeCount() - 1);
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (size_t i = 0; i < frame.pixels.size(); i += 5) {
      ASSERT_EQ(frame.pixels[i + 3], 1.0f) << kernel.name;
      ASSERT_NEAR(double(frame.pixels[i + 4]), 12, node + 1.0 / 64) << kernel.name;
    }
  }
}

TEST(ZeroWidthRange, ShowsEveryValueInTheColourOfTheOne) {
  const test::Scene scene = test::plume(ElementType::f32);
  const TransferFunction tf({{0, {0, 0, 0}}, {1, {1, 0.5, 0.25}}}, {{0, 0}, {1, 0.1}});
  for (float value : {0.0f, 0.3f, 1.0f}) {
    RenderSettings settings = test::settingsFor(scene, "iso", tf);
    settings.range = {value, value};
    settings.terminate = 1;
    const test::Caster caster(scene, settings);
    const std::vector<int> counts = caster.sampleCounts();
    for (const auto& kernel : caster.kernels()) {
      const auto frame = caster.cast(kernel);
      for (size_t p = 0; p < counts.size(); ++p)
        ASSERT_NEAR(double(frame.pixel(p)[3]), correctedOpacity(0.1 * double(value), counts[p]),
                    test::kFullPrecision)
            << kernel.name;
    }
  }
}

TEST(NarrowBands, InWhiteNoiseStayWithinThePositionsError) {
  // Neighbouring voxels differ by the whole range and bands are 3 % of it wide: a ray crosses hundreds of
  // edges.
  const test::Scene scene = test::denseNoise(ElementType::f32);
  const TransferFunction tf(
      {{0, {1, 1, 1}}},
      {{0, 0}, {0.3, 0}, {0.315, 0.5}, {0.33, 0}, {0.6, 0}, {0.615, 0.5}, {0.63, 0}, {1, 0}});
  for (const char* camera : {"iso", "close", "inside", "ortho"}) {
    RenderSettings settings = test::settingsFor(scene, camera, tf);
    settings.terminate = 1;
    const test::Caster caster(scene, settings);
    const auto reference = caster.reference();
    // A sample on an edge (0.5 over 0.015) is off by slope * 0.8 * 1.7 voxels' rise * the position's error. A
    // ray meets a few tens, either way and ever fainter; the position's largest error is rare: a third of it
    // in all.
    const double sample = 0.5 / 0.015 * 0.8 * 1.7 * test::kPositionError / 3;
    for (const auto& kernel : caster.kernels())
      EXPECT_LE(test::largestDifference(test::asDoubles(caster.cast(kernel)), reference), sample)
          << camera << " " << kernel.name;
  }
}

}  // namespace
}  // namespace kairos
