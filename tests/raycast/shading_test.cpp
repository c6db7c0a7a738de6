// Gradients and the headlight against their formulas, and transforms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "raycast/cast_frame.h"
#include "raycast/headlight.h"

namespace kairos {
namespace {

const Vec3d kColour{0.8, 0.4, 0.1};
constexpr double kAlpha = 0.05;

// f = 0.5 + slope . (p - centre) in index space, over 40^3 voxels.
test::Scene ramp(const Vec3d& slope) {
  test::Scene scene{"ramp", test::denseLattice(ElementType::f32, {40, 40, 40}), {}};
  scene.field = test::sampledField(scene.lattice, [&](const Vec3i& v) {
    return 0.5 + dot(slope, Vec3d(v) - Vec3d{19.5, 19.5, 19.5});
  });
  return scene;
}

RenderSettings rampSettings(const test::Scene& scene, const Vec3d& from) {
  const PointBox box = scene.lattice.worldBounds();
  const Vec3d centre = (box.lo + box.hi) * 0.5;
  RenderSettings settings =
      test::settingsFor(scene, "iso", {{{0, kColour}}, {{0, kAlpha}, {1, kAlpha}}}, 9, 9);
  settings.camera.projection = Camera::Projection::orthographic;
  settings.camera.eye = centre + normalized(from) * (2 * length(box.hi - box.lo));
  settings.camera.target = centre;
  settings.camera.up = {0.3, 1, 0.2};
  settings.camera.imageHeight = 0.02 * length(box.hi - box.lo);
  settings.shade = true;
  settings.terminate = 1;
  // Away from the faces, where the differences reach beyond the data.
  const Vec3d half = (box.hi - box.lo) * 0.08;
  settings.clipBox = PointBox{centre - half, centre + half};
  return settings;
}

// What the headlight makes of kColour, at opacity 1, for a world-space gradient g per voxel.
Vec3d lit(const Vec3d& g, const Vec3d& direction) {
  const double g0 = double(Headlight::kFlatGradient), squared = dot(g, g), guarded = squared + g0 * g0;
  const double cosine = std::abs(dot(g, direction)) / std::sqrt(guarded), w = squared / guarded;
  const double factor = (1 - w) + w * double(Headlight::kAmbient) + double(Headlight::kDiffuse) * cosine;
  const double highlight = double(Headlight::kSpecular) * std::pow(cosine, 16);
  return kColour * factor + Vec3d{highlight, highlight, highlight};
}

void expectLit(const test::Scene& scene, const RenderSettings& settings, const Vec3d& gradient) {
  const test::Caster caster(scene, settings);
  const Vec3d expected = lit(gradient, normalized(settings.camera.target - settings.camera.eye));
  const auto check = [&](const auto& pixels, const char* what) {
    for (size_t i = 0; i < pixels.size(); i += 4) {
      ASSERT_GT(pixels[i + 3], 0.05) << what;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(double(pixels[i + size_t(c)]) / double(pixels[i + 3]), expected[c], 2e-5)
            << what << " channel " << c;
    }
  };
  check(caster.reference(), "reference");
  for (const auto& kernel : caster.kernels()) check(caster.cast(kernel).pixels, kernel.name);
}

TEST(Headlight, LightsALinearRampByItsExactGradient) {
  for (const Vec3d& slope :
       {Vec3d{0.01, 0, 0}, {0, -0.012, 0}, {0, 0, 0.009}, {0.004, -0.003, 0.005}, {1e-4, 0, 0}})
    for (const Vec3d& from : {Vec3d{1, 0.1, 0.05}, {0.2, -1, 0.7}, {-0.4, 0.3, 1}}) {
      const auto scene = ramp(slope);
      expectLit(scene, rampSettings(scene, from), slope);
      if (HasFatalFailure()) FAIL() << slope.x << " " << slope.y << " " << slope.z;
    }
}

TEST(Headlight, TakesGradientsInWorldSpaceWhateverTheVoxels) {
  // Voxels of 1 x 2 x 3, turned: a gradient per shortest voxel edge is the world gradient times that edge.
  const Vec3d slope{0.006, 0.01, -0.009};
  auto scene = ramp(slope);
  const double c = std::cos(0.5), s = std::sin(0.5);
  scene.lattice.worldFromIndex = {{Vec3d{c, s, 0}, Vec3d{-2 * s, 2 * c, 0}, Vec3d{0, 0, 3}}, {10, -20, 5}};
  const Vec3d world = scene.lattice.worldFromIndex.inverse().transposedVector(slope);
  EXPECT_NEAR(world.x, c * slope.x - s * slope.y / 2, 1e-12);
  for (const Vec3d& from : {Vec3d{1, 0.1, 0.05}, {-0.2, -1, 0.7}})
    expectLit(scene, rampSettings(scene, from), world);
}

TEST(Headlight, LeavesFlatMatterAsItIs) {
  const auto scene = ramp({0, 0, 0});
  expectLit(scene, rampSettings(scene, {1, 2, 3}), {0, 0, 0});
}

TEST(Headlight, GradientsAreTakenOnlyWhereSomethingIsSeen) {
  const auto scene = test::plume(ElementType::u8);
  RenderSettings settings = test::settingsFor(scene, "iso", test::windowedTransferFunction(ElementType::u8));
  const test::Caster plain(scene, settings);
  for (const auto& kernel : plain.kernels())
    EXPECT_EQ(plain.cast(kernel).counters.gradients, 0u) << kernel.name;
  settings.shade = true;
  const test::Caster shaded(scene, settings);
  for (const auto& kernel : shaded.kernels()) {
    const TileCounters counters = shaded.cast(kernel).counters;
    EXPECT_GT(counters.gradients, 0u) << kernel.name;
    EXPECT_LT(counters.gradients, counters.samples) << kernel.name;
  }
}

// ---- depth ----

TEST(Depth, OfAThinOpaqueWallIsItsDistanceAndInfiniteNowhereHere) {
  test::Scene scene{"wall", test::denseLattice(ElementType::u8, {32, 32, 32}), {}};
  scene.field =
      test::sampledField(scene.lattice, [](const Vec3i& v) { return v.z >= 9 && v.z <= 11 ? 1.0 : 0.0; });
  RenderSettings settings =
      test::settingsFor(scene, "orthoZ", {{{0, {1, 1, 1}}}, {{0, 0}, {100, 0}, {101, 1}, {255, 1}}}, 8, 8);
  settings.camera.eye = {16, 16, 60};
  settings.camera.target = {16, 16, 0};
  settings.camera.imageHeight = 8;
  settings.depth = true;
  settings.step = 0.25;
  const test::Caster caster(scene, settings);
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (size_t p = 0; p < 64; ++p) {
      ASSERT_NEAR(frame.pixel(p)[3], 1, 1e-6);
      ASSERT_NEAR(frame.pixel(p)[4], 60 - 11.6, 0.25)
          << kernel.name;  // where the ramp from 12 to 11 passes 100/255
    }
  }
}

// ---- transforms ----

// The same scene and camera, turned, scaled and moved together.
void moveTogether(test::Scene& scene, RenderSettings& settings, double scale) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Affine turn{
      {Vec3d{c, s, 0} * scale, Vec3d{-s * 0.6, c * 0.6, 0.8} * scale, Vec3d{s * 0.8, -c * 0.8, 0.6} * scale},
      {31, -7, 2}};
  Affine& m = scene.lattice.worldFromIndex;
  m = {{turn.vector(m.column[0]), turn.vector(m.column[1]), turn.vector(m.column[2])},
       turn.point(m.translation)};
  settings.camera.eye = turn.point(settings.camera.eye);
  settings.camera.target = turn.point(settings.camera.target);
  settings.camera.up = turn.vector(settings.camera.up) * (1 / scale);
  settings.camera.imageHeight *= scale;
}

TEST(Transforms, TurningAndScalingVolumeAndCameraTogetherLeavesTheImage) {
  for (ElementType type : test::kAllTypes)
    for (const char* camera : {"iso", "inside", "ortho", "close"})
      for (bool shade : {false, true})
        for (double scale : {1.0, 37.0, 0.004, 1e9, 1e-7}) {
          test::Scene scene = test::plume(type);
          RenderSettings settings = test::settingsFor(scene, camera, test::softTransferFunction(type));
          settings.shade = shade;
          const auto before = test::Caster(scene, settings).reference();
          moveTogether(scene, settings, scale);
          const test::Caster moved(scene, settings);
          const auto after = moved.reference();
          const auto frame = moved.cast();
          double alpha = 0;
          for (size_t i = 0; i < before.size(); ++i) {
            ASSERT_NEAR(after[i], before[i], 1e-5) << camera << " " << scale;
            ASSERT_NEAR(double(frame.pixels[i]), before[i], 1e-5) << camera << " " << scale;
            alpha += before[i];
          }
          EXPECT_GT(alpha, 10) << camera;
        }
}

TEST(Transforms, AnAnisotropicVolumeLooksLikeItsIsotropicTwin) {
  // A ramp sampled half as densely along y is the same function: linear interpolation has no error there.
  const auto fine = ramp({0.004, 0.006, -0.003});
  test::Scene coarse{"coarse", test::denseLattice(ElementType::f32, {40, 20, 40}), {}};
  coarse.field = test::sampledField(coarse.lattice, [&](const Vec3i& v) {
    return fine.field.value({v.x, 2 * v.y, v.z});
  });
  coarse.lattice.worldFromIndex = Affine::scale({1, 2, 1});
  const auto cast = [&](const test::Scene& scene) {
    RenderSettings settings = rampSettings(fine, {1, -1.5, 0.8});
    settings.transferFunction = test::softTransferFunction(ElementType::f32);
    return test::Caster(scene, settings).reference();
  };
  const auto a = cast(fine), b = cast(coarse);
  for (size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-5);
}

}  // namespace
}  // namespace kairos
