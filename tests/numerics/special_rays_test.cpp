// Rays and eyes where a comparison decides: along faces, through corners, from a voxel, from very far.
#include <gtest/gtest.h>

#include <cmath>

#include "numerics/field_oracle.h"

namespace kairos {
namespace {

RenderSettings orthographic(const test::Scene& scene, const Vec3d& eye, const Vec3d& direction, double pitch,
                            int pixels) {
  RenderSettings settings =
      test::settingsFor(scene, "orthoZ", test::softTransferFunction(scene.lattice.type), pixels, pixels);
  settings.camera.eye = eye;
  settings.camera.target = eye + direction;
  settings.camera.up = std::abs(direction.z) > 0.5 * length(direction) ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  settings.camera.imageHeight = pitch * pixels;
  settings.step = 0.5;
  return settings;
}

// Smooth matter wherever the grid has a corner; nothing at the outermost voxels.
test::Scene cloud(ElementType type) {
  test::Scene scene{"cloud", test::sparseLattice(type, {36, 31, 39}, {-11, 3, -30}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) {
    return 0.2 * test::smoothNoise(Vec3d(v), 7, 5) + 0.1 * test::smoothNoise(Vec3d(v), 3, 6);
  });
  return scene;
}

const std::vector<test::Scene>& scenes() {
  static const std::vector<test::Scene> all{cloud(ElementType::u8), cloud(ElementType::f32)};
  return all;
}

Vec3d gridCorner(const test::Scene& scene) {
  // A brick corner amid the matter: bricks lie at multiples of 16 from the grid's origin.
  const test::Caster caster(scene,
                            test::settingsFor(scene, "x", test::softTransferFunction(scene.lattice.type)));
  return Vec3d(caster.volume().gridOrigin() + Vec3i{16, 16, 16});
}

TEST(AxisParallelRays, CastTheFieldOnFacesEdgesAndVoxelCentres) {
  for (const auto& scene : scenes())
    for (const Vec3d& d : {Vec3d{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}})
      for (double pitch : {0.5, 1.0, 4.0}) {
        // An odd image: its central ray runs along an edge shared by four bricks.
        const double opacity = test::expectCastsTheField(
            scene, orthographic(scene, gridCorner(scene) - d * 64.0, d, pitch, 9), "along an axis");
        EXPECT_GT(opacity, 0.1) << pitch;
      }
}

TEST(CornerRays, CastTheFieldThroughTheCornersOfBricks) {
  for (const auto& scene : scenes())
    for (const Vec3d& d : {Vec3d{1, 1, 1}, {-1, 1, 1}, {1, -1, -1}, {1, 1, 0}, {0, -1, 1}, {-1, 0, -1}}) {
      const double opacity = test::expectCastsTheField(
          scene, orthographic(scene, gridCorner(scene) - d * 48.0, d, 1, 7), "through corners");
      EXPECT_GT(opacity, 0.1);
    }
}

TEST(GrazingRays, CastTheFieldAtAnySmallestSlope) {
  for (const auto& scene : scenes())
    for (double slope : {1e-16, 1e-12, 1e-8, 1e-5, -1e-8, -1e-14}) {
      // Along x in the plane between two layers of bricks, and just off it.
      const Vec3d eye = gridCorner(scene) - Vec3d{64, 0, 0};
      test::expectCastsTheField(scene, orthographic(scene, eye, {1, slope, -slope}, 1, 7), "grazing");
    }
}

TEST(GrazingRays, OnTheOutermostVoxelsOfDenseDataSeeThem) {
  const test::Scene scene = test::constantScene(ElementType::u8, {17, 9, 13}, 0.6);
  for (const auto& [eye, d] : {std::pair(Vec3d{-8, 0, 0}, Vec3d{1, 0, 0}),
                               {{24, 8, 12}, {-1, 0, 0}},
                               {{0, -8, 12}, {0, 1, 0}},
                               {{16, 8, 24}, {0, 0, -1}}}) {
    const double opacity =
        test::expectCastsTheField(scene, orthographic(scene, eye, d, 1, 1), "on the outermost voxels");
    EXPECT_GT(opacity, 0.1);
  }
}

TEST(ReversedRays, SeeTheSameOpacity) {
  // Transmittances multiply in either order, and both lattices share their samples: 2 * 40 / 0.5 is whole.
  for (const auto& scene : scenes())
    for (const Vec3d& d : {Vec3d{0, 0, 1}, normalized({1, 2, -3}), normalized({-0.3, 1, 0.1})}) {
      const PointBox box = scene.lattice.worldBounds();
      const Vec3d centre = (box.lo + box.hi) * 0.5;
      const auto there = orthographic(scene, centre - d * 40.0, d, 1.5, 8);
      const auto back = orthographic(scene, centre + d * 40.0, -d, 1.5, 8);
      RenderSettings settings[2] = {there, back};
      for (auto& s : settings) s.terminate = 1;
      const test::Caster forwards(scene, settings[0]), backwards(scene, settings[1]);
      const auto kernels = forwards.kernels(), reversedKernels = backwards.kernels();
      for (size_t k = 0; k < kernels.size(); ++k) {
        const auto a = forwards.cast(kernels[k]), b = backwards.cast(reversedKernels[k]);
        double seen = 0;
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 8; ++x) {
            // The image from behind is mirrored left to right: right = forward x up changes sign.
            const float alpha = a.pixel(size_t(y * 8 + x))[3], mirrored = b.pixel(size_t(y * 8 + 7 - x))[3];
            ASSERT_NEAR(double(alpha), double(mirrored), test::kFullPrecision) << kernels[k].name;
            seen += double(alpha);
          }
        EXPECT_GT(seen, 1);
      }
    }
}

RenderSettings perspective(const test::Scene& scene, const Vec3d& eye, const Vec3d& direction, double fov) {
  RenderSettings settings =
      test::settingsFor(scene, "inside", test::softTransferFunction(scene.lattice.type), 9, 9);
  settings.camera.eye = eye;
  settings.camera.target = eye + direction;
  settings.camera.up = std::abs(direction.z) > 0.5 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  settings.camera.verticalFovDegrees = fov;
  settings.step = 0.5;
  return settings;
}

TEST(Eye, OnAVoxelAFaceOrACornerOfABrickCastsTheField) {
  for (const auto& scene : scenes()) {
    const Vec3d corner = gridCorner(scene);
    for (const Vec3d& offset : {Vec3d{0, 0, 0}, {1, 2, 3}, {0, 5.25, -3.5}, {-0.5, -0.5, -0.5}, {3.2, 0, 0}})
      for (const Vec3d& d : {Vec3d{1, 0, 0}, {0, 0, -1}, normalized({-1, -1, 1}), normalized({0.2, 1, -0.4})})
        for (double fov : {60.0, 140.0})
          test::expectCastsTheField(scene, perspective(scene, corner + offset, d, fov), "eye inside");
  }
}

TEST(Eye, OnAFaceOfDenseDataSeesAllOfIt) {
  const test::Scene scene = test::constantScene(ElementType::u8, {17, 9, 13}, 0.6);
  // On the face z = 0 (the centres of the outermost voxels), looking up through the whole thickness.
  RenderSettings settings = perspective(scene, {8, 4, 0}, {0, 0, 1}, 2);
  const double opacity = test::expectCastsTheField(scene, settings, "on a face");
  EXPECT_GT(opacity, 9 * 9 * 0.3);
}

TEST(Eye, AMillionVoxelsAwayCastsTheField) {
  for (const auto& scene : scenes()) {
    const PointBox box = scene.lattice.worldBounds();
    const Vec3d centre = (box.lo + box.hi) * 0.5;
    for (const Vec3d& d : {Vec3d{0, 0, -1}, normalized({1, 2, -3}), normalized({-0.3, 1, 0.1})})
      for (double away : {1e6, 2e7}) {
        const double fov = 2 * std::atan(20 / away) * 180 / 3.14159265358979;
        const double opacity =
            test::expectCastsTheField(scene, perspective(scene, centre - d * away, d, fov), "far away");
        EXPECT_GT(opacity, 1) << away;
      }
  }
}

TEST(Depth, FromAMillionVoxelsAwayIsAsExactAsAFloat) {
  // A thin wall, opaque: the depth is its distance, within a sample and the spacing of floats there.
  test::Scene scene{"wall", test::denseLattice(ElementType::u8, {33, 33, 33}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return v.z == 16 ? 1.0 : 0.0; });
  RenderSettings settings = test::fromAbove(scene, {{{0, {1, 1, 1}}}, {{0, 0}, {127, 0}, {127, 1}, {255, 1}}},
                                            {16, 16, 1e6 + 16}, 16, 8);
  settings.depth = true;
  settings.step = 0.25;
  const test::Caster caster(scene, settings);
  for (const auto& kernel : caster.kernels()) {
    const auto frame = caster.cast(kernel);
    for (size_t p = 0; p < 64; ++p)
      ASSERT_NEAR(double(frame.pixel(p)[4]), 1e6 - 0.5, 0.25 + 1e6 * 0x1p-22) << kernel.name;
  }
}

}  // namespace
}  // namespace kairos
