// Index space far from world space: offsets, thin voxels, turned axes.
#include <gtest/gtest.h>

#include <cmath>

#include "numerics/field_oracle.h"

namespace kairos {
namespace {

// Voxels of `size`, turned about a skew axis, at `translation`.
Affine turned(const Vec3d& size, const Vec3d& translation) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  return {{Vec3d{c, s, 0} * size.x, Vec3d{-s * 0.6, c * 0.6, 0.8} * size.y,
           Vec3d{s * 0.8, -c * 0.8, 0.6} * size.z},
          translation};
}

// Moves volume, camera and clip box by the same vector.
void moveTogether(test::Scene& scene, RenderSettings& settings, const Vec3d& by) {
  Affine& m = scene.lattice.worldFromIndex;
  m.translation = m.translation + by;
  settings.camera.eye = settings.camera.eye + by;
  settings.camera.target = settings.camera.target + by;
  if (settings.clipBox) settings.clipBox = PointBox{settings.clipBox->lo + by, settings.clipBox->hi + by};
}

// To multiples of 2^-26, so that adding 1e7 loses nothing.
Vec3d rounded(const Vec3d& v) {
  return {std::round(v.x * 0x1p26) * 0x1p-26, std::round(v.y * 0x1p26) * 0x1p-26,
          std::round(v.z * 0x1p26) * 0x1p-26};
}

TEST(WorldOffset, OfTenMillionWithSmallVoxelsChangesNothing) {
  for (const char* camera : {"iso", "inside", "ortho"})
    for (bool turn : {false, true})
      for (bool clip : {false, true}) {
        test::Scene scene = test::plume(ElementType::f32);
        scene.lattice.worldFromIndex =
            turn ? turned({1e-3, 1.1e-3, 1.3e-3}, {}) : Affine::scale({1e-3, 1e-3, 1e-3});
        scene.lattice.worldFromIndex.translation = rounded({0.5, -0.25, 1.0 / 3});
        RenderSettings settings =
            test::settingsFor(scene, camera, test::softTransferFunction(ElementType::f32));
        settings.camera.eye = rounded(settings.camera.eye);
        settings.camera.target = rounded(settings.camera.target);
        if (clip) {
          const PointBox box = scene.lattice.worldBounds();
          settings.clipBox = PointBox{rounded(box.lo + (box.hi - box.lo) * 0.2), rounded(box.hi)};
        }
        const auto before = test::Caster(scene, settings).reference();
        moveTogether(scene, settings, {1e7, -1e7, 3e6});
        const test::Caster moved(scene, settings);
        // Offsets between eye, volume and clip box are exact in double; only where a clipped sample lies on
        // the box's very face may it take either side, and none does here.
        EXPECT_LE(test::largestDifference(moved.reference(), before), 1e-9) << camera << turn << clip;
        for (const auto& kernel : moved.kernels())
          EXPECT_LE(test::largestDifference(test::asDoubles(moved.cast(kernel)), before),
                    test::kFullPrecision)
              << camera << " " << kernel.name;
      }
}

TEST(IndexOffset, OfTenMillionVoxelsChangesNothing) {
  for (const char* camera : {"iso", "inside", "ortho"}) {
    test::Scene scene = test::plume(ElementType::u8);
    RenderSettings settings = test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8));
    settings.camera.eye = rounded(settings.camera.eye);
    settings.camera.target = rounded(settings.camera.target);
    const auto before = test::Caster(scene, settings).reference();
    // Multiples of 16, so that bricks and leaves cut the data in the same places.
    const Vec3i by{16 * 625'000, -16 * 625'000, 16 * 100'000};
    scene.lattice.domain = {scene.lattice.domain.lo + by, scene.lattice.domain.hi + by};
    scene.field.bounds = {scene.field.bounds.lo + by, scene.field.bounds.hi + by};
    for (Vec3i& origin : scene.field.leafOrigins) origin = origin + by;
    settings.camera.eye = settings.camera.eye + Vec3d(by);
    settings.camera.target = settings.camera.target + Vec3d(by);
    const test::Caster moved(scene, settings);
    EXPECT_LE(test::largestDifference(moved.reference(), before), 1e-9) << camera;
    for (const auto& kernel : moved.kernels())
      EXPECT_LE(test::largestDifference(test::asDoubles(moved.cast(kernel)), before), test::kFullPrecision)
          << camera << " " << kernel.name;
  }
}

TEST(ThinVoxels, AHundredTimesLongerThanWideCastTheField) {
  // One long axis, then two; upright and turned. The sample distance is the shortest edge.
  for (const Vec3d& size : {Vec3d{1, 1, 100}, {0.01, 1, 0.01}, {100, 1, 100}})
    for (bool turn : {false, true}) {
      test::Scene scene{"thin", test::sparseLattice(ElementType::f32, {14, 12, 13}), {}};
      if (size.x == 100) scene.lattice.domain.hi = {4, 40, 3};
      scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) { return test::whiteNoise(v, 3); });
      scene.lattice.worldFromIndex = turn ? turned(size, {3, -5, 7}) : Affine::scale(size);
      for (const char* camera : {"iso", "ortho", "-y"}) {
        RenderSettings settings =
            test::settingsFor(scene, camera, test::softTransferFunction(ElementType::f32), 9, 9);
        const double opacity = test::expectCastsTheField(scene, settings, camera);
        EXPECT_GT(opacity, 0.1) << camera << " " << size.x;
      }
    }
}

}  // namespace
}  // namespace kairos
