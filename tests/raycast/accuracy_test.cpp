// Every kernel on every instruction set against the double reference, and the reference against an oracle
// that knows neither bricks nor segments.
#include <gtest/gtest.h>

#include <tuple>

#include "raycast/cast_frame.h"

namespace kairos {
namespace {

struct Variant {
  const char* name;
  Filter filter;
  RenderMode mode;
  bool shade, depth;
};
constexpr Variant kVariants[] = {
    {"plain", Filter::trilinear, RenderMode::dvr, false, false},
    {"shaded", Filter::trilinear, RenderMode::dvr, true, false},
    {"depth", Filter::trilinear, RenderMode::dvr, false, true},
    {"shadedDepth", Filter::trilinear, RenderMode::dvr, true, true},
    {"mip", Filter::trilinear, RenderMode::mip, false, false},
    {"average", Filter::trilinear, RenderMode::average, false, false},
    {"nearest", Filter::nearest, RenderMode::dvr, false, false},
    {"nearestShadedDepth", Filter::nearest, RenderMode::dvr, true, true},
    {"nearestMip", Filter::nearest, RenderMode::mip, false, false},
    {"nearestAverage", Filter::nearest, RenderMode::average, false, false},
};
constexpr size_t kVariantCount = std::size(kVariants);

RenderSettings with(RenderSettings settings, const Variant& variant) {
  settings.filter = variant.filter;
  settings.mode = variant.mode;
  settings.shade = variant.shade;
  settings.depth = variant.depth;
  return settings;
}

void expectKernelsMatch(const test::Scene& scene, const RenderSettings& settings, const std::string& what) {
  const test::Caster caster(scene, settings);
  const std::vector<double> reference = caster.reference();
  for (const auto& kernel : caster.kernels()) {
    const test::Deviation d = test::deviation(caster, caster.cast(kernel), reference);
    // Nearest is a step function of the position: a sample within float rounding of a voxel's face may take
    // either side.
    const int allowed = settings.filter == Filter::nearest ? settings.width * settings.height / 300 : 0;
    EXPECT_LE(d.pixelsBeyond, allowed) << what << " " << kernel.name << ", largest difference " << d.largest;
  }
}

class KernelAccuracy : public testing::TestWithParam<std::tuple<ElementType, size_t>> {};

// All scenes, cameras and types; transfer functions, variants, steps and image sizes take turns, so that each
// meets each.
TEST_P(KernelAccuracy, StaysWithin1e5OfTheReference) {
  const auto [type, sceneNumber] = GetParam();
  const test::Scene scene = test::allScenes(type)[sceneNumber];
  const auto functions = test::allTransferFunctions(type);
  size_t turn = sceneNumber + size_t(type);
  for (const std::string& camera : test::cameraNames())
    for (int round = 0; round < 3; ++round, ++turn) {
      const auto& tf = functions[turn % functions.size()];
      const Variant& variant = kVariants[(turn * 7 + turn / kVariantCount) % kVariantCount];
      const bool odd = turn % 2 != 0;
      RenderSettings settings =
          with(test::settingsFor(scene, camera, tf.function, odd ? 39 : 40, odd ? 33 : 36), variant);
      settings.step = turn % 5 == 0 ? 0.37 : turn % 5 == 1 ? 1.6 : 1;
      settings.terminate = turn % 4 == 3 ? 1.0f : 0.999f;
      expectKernelsMatch(scene, settings, scene.name + " " + camera + " " + tf.name + " " + variant.name);
    }
}

INSTANTIATE_TEST_SUITE_P(AllScenes, KernelAccuracy,
                         testing::Combine(testing::ValuesIn(test::kAllTypes),
                                          testing::Range(size_t(0), size_t(9))),
                         [](const auto& combination) {
                           const size_t number = std::get<1>(combination.param);
                           return test::allScenes(ElementType::u8)[number].name + "_" +
                                  std::string(kairos::name(std::get<0>(combination.param)));
                         });

// Integer weights exist where the packet kernel does; elsewhere fast is as accurate as full.
TEST_P(KernelAccuracy, StaysWithin3e4OfTheReferenceWhenFast) {
  const auto [type, sceneNumber] = GetParam();
  const test::Scene scene = test::allScenes(type)[sceneNumber];
  const auto functions = test::allTransferFunctions(type);
  size_t turn = sceneNumber;
  for (const char* camera : {"iso", "close", "ortho", "orthoZ", "inside", "-y"})
    for (const double step : {1.0, 0.3}) {
      const auto& tf = functions[turn++ % functions.size()];
      RenderSettings settings = test::settingsFor(scene, camera, tf.function, 40, 36);
      settings.step = step;
      settings.precision = Precision::fast;
      const test::Caster caster(scene, settings);
      for (const auto& kernel : caster.kernels())
        EXPECT_LE(test::deviation(caster, caster.cast(kernel), caster.reference()).largest, 3e-4)
            << camera << " " << tf.name << " " << kernel.name << " step " << step;
    }
}

TEST(Kernels, MatchTheReferenceOnTheBundledJet) {
  const test::Scene scene = test::jet1(40);
  for (const auto& tf : test::allTransferFunctions(ElementType::u8))
    for (const char* camera : {"iso", "inside", "close"})
      for (const Variant& variant : {kVariants[0], kVariants[3]})
        expectKernelsMatch(scene, with(test::settingsFor(scene, camera, tf.function, 61, 50), variant),
                           std::string(camera) + " " + tf.name + " " + variant.name);
}

TEST(Kernels, MatchTheReferenceWhereVoxelsAreNegativeAndTheBackgroundIsNotZero) {
  test::Scene scene = test::plume(ElementType::f32);
  for (float& v : valuesAs<float>(scene.field.values)) v = 0.7f - 2 * v;
  scene.field.background = scene.lattice.background = double(0.7f);
  for (const Variant& variant : {kVariants[0], kVariants[1], kVariants[4], kVariants[5]}) {
    RenderSettings settings =
        with(test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::f32)), variant);
    settings.transferFunction =
        TransferFunction({{-1, {1, 0.5, 0.2}}, {0.6, {0, 0.3, 1}}}, {{-1, 0.4}, {0.5, 0.1}, {0.6, 0}});
    settings.range = {-1, 0.8f};
    expectKernelsMatch(scene, settings, variant.name);
  }
}

TEST(Kernels, MatchTheReferenceForSingleVoxelAxesAndTinyImages) {
  for (const Vec3i& dims : {Vec3i{1, 1, 1}, {40, 1, 30}, {1, 37, 1}, {2, 2, 40}}) {
    test::Scene scene = test::constantScene(ElementType::u8, dims, 0.6);
    for (const char* camera : {"iso", "x", "inside", "ortho"})
      for (const Vec3i& size : {Vec3i{1, 1, 0}, {3, 5, 0}, {17, 2, 0}})
        expectKernelsMatch(
            scene,
            test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), size.x, size.y),
            std::string(camera) + " " + std::to_string(dims.x));
  }
}

// ---- the reference itself ----

TEST(ReferenceCaster, MatchesAnOracleWithoutBricksAndSegments) {
  for (ElementType type : {ElementType::u8, ElementType::f32})
    for (const auto& scene : test::allScenes(type)) {
      const bool negative = scene.lattice.domain.lo.x < 0;
      for (const char* camera : {"iso", "inside", "close", "orthoZ"})
        for (size_t v : {0, 4, 5, 6}) {
          RenderSettings settings = with(
              test::settingsFor(scene, camera, test::windowedTransferFunction(type), 14, 11), kVariants[v]);
          settings.terminate = 1;
          settings.step = negative ? 0.7 : 1.3;
          const test::Caster caster(scene, settings);
          const auto expected = test::castFieldDirectly(scene, settings);
          const auto found = caster.reference();
          ASSERT_EQ(expected.size(), found.size());
          for (size_t i = 0; i < found.size(); ++i) {
            // A ray that misses has no maximum; the two say so in the same way.
            if (found[i] != expected[i]) {
              ASSERT_NEAR(found[i], expected[i], 1e-9 * (1 + std::abs(expected[i])))
                  << scene.name << " " << camera << " " << kVariants[v].name << " value " << i;
            }
          }
        }
    }
}

TEST(ReferenceCaster, SeesNothingInAnEmptyVolume) {
  const auto scene = test::emptyScene(ElementType::u16);
  const test::Caster caster(scene,
                            test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::u16)));
  for (double v : caster.reference()) ASSERT_EQ(v, 0.0);
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (float v : frame.pixels) ASSERT_EQ(v, 0.0f);
    EXPECT_EQ(frame.counters.samples, 0u);
    EXPECT_GT(frame.counters.segmentsSkipped, 0u);
  }
}

TEST(ReferenceCaster, SeesASingleVoxelWhereItStands) {
  const auto scene = test::singleVoxel(ElementType::u8);
  // Straight down: pixel pitch half a voxel, the voxel (5, 6) at its own place and nothing two voxels away.
  RenderSettings settings =
      test::settingsFor(scene, "orthoZ", test::softTransferFunction(ElementType::u8), 32, 32);
  settings.camera.imageHeight = 16;
  settings.camera.eye = {8, 8, 40};
  settings.camera.target = {8, 8, 0};
  settings.step = 0.25;
  const test::Caster caster(scene, settings);
  const auto frame = caster.cast();
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      const double worldX = (x + 0.5) / 2, worldY = 16 - (y + 0.5) / 2;
      const float alpha = frame.pixel(size_t(y * 32 + x))[3];
      const double away = std::max(std::abs(worldX - 5), std::abs(worldY - 6));
      if (away >= 1) {
        EXPECT_EQ(alpha, 0.0f) << x << " " << y;
      } else if (away < 0.3) {
        EXPECT_GT(alpha, 0.01f) << x << " " << y;
      }
    }
}

}  // namespace
}  // namespace kairos
