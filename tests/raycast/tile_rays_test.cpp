// Which samples a ray has: the sampling box, the clip box, the eye; and the planes that divide them.
#include "raycast/tile_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "raycast/cast_frame.h"

namespace kairos {
namespace {

constexpr int32_t kFar = 1 << 30;

TEST(FirstSampleBeyond, IsTheFirstSamplePastThePlane) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-200, 200), slope(-3, 3);
  for (int i = 0; i < 200000; ++i) {
    const double plane = i % 3 == 0 ? std::floor(place(random) / 16) * 16 : place(random);
    const double origin = i % 5 == 0 ? std::floor(place(random)) : place(random), delta = slope(random);
    if (std::abs(delta) < 1e-4) continue;
    const int32_t k = firstSampleBeyond(plane, origin, delta);
    const double sign = delta < 0 ? -1 : 1, tolerance = 1e-9;
    ASSERT_GE(sign * (origin + (k + 0.5) * delta - plane), -tolerance)
        << plane << " " << origin << " " << delta;
    ASSERT_LE(sign * (origin + (k - 0.5) * delta - plane), tolerance)
        << plane << " " << origin << " " << delta;
  }
}

TEST(FirstSampleBeyond, MeetsPlanesInTheOrderTheRayDoes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-100, 100), exponent(-20, 1);
  for (int i = 0; i < 20000; ++i) {
    const double origin = i % 2 == 0 ? std::floor(place(random)) : place(random);
    const double delta = (i % 4 < 2 ? 1 : -1) * std::pow(10, exponent(random));
    int32_t previous = delta > 0 ? -kFar : kFar;
    for (int plane = -160; plane <= 160; plane += 16) {
      const int32_t k = firstSampleBeyond(plane, origin, delta);
      if (delta > 0) {
        ASSERT_GE(k, previous) << origin << " " << delta;
      } else {
        ASSERT_LE(k, previous) << origin << " " << delta;
      }
      previous = k;
    }
  }
}

TEST(FirstSampleBeyond, AParallelRayIsBeyondEveryPlaneUpToItsOwn) {
  EXPECT_EQ(firstSampleBeyond(16, 15.999, 0), kFar);
  EXPECT_EQ(firstSampleBeyond(16, 16.001, 0), -kFar);
  EXPECT_LE(firstSampleBeyond(16, 16, 0), 0);
  EXPECT_LE(firstSampleBeyond(16, 16, -0.0), 0);
}

TEST(FirstSampleBeyond, ASampleOnAPlaneBelongsToOneSide) {
  // Samples at 0.5, 1.5, ...: sample 3 stands on the plane 3.5; going up it is past it, going down it is not
  // yet.
  EXPECT_EQ(firstSampleBeyond(3.5, 0, 1), 3);
  EXPECT_EQ(firstSampleBeyond(-3.5, 0, -1), 4);
}

TEST(FirstSampleBeyond, TakesTheSmallestSlopes) {
  for (double delta : {1e-250, -1e-250, 1e-18, -1e-18}) {
    EXPECT_EQ(firstSampleBeyond(16, 8, delta), delta > 0 ? kFar : -kFar) << delta;
    EXPECT_EQ(firstSampleBeyond(16, 16, delta), 0) << delta;
  }
}

// ---- sample ranges ----

bool strictlyInside(const PointBox& box, const Vec3d& p, double margin) {
  for (int a = 0; a < 3; ++a)
    if (!(p[a] > box.lo[a] + margin && p[a] < box.hi[a] - margin)) return false;
  return true;
}

// Samples clearly inside must be in the range, samples clearly outside must not; on the faces rounding may
// decide.
void expectExactRanges(const test::Scene& scene, const RenderSettings& settings) {
  const test::Caster caster(scene, settings);
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  const Affine indexFromWorld = scene.lattice.worldFromIndex.inverse();
  const double step = settings.worldStep(scene.lattice);
  const PointBox everything{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}};
  const PointBox box = scene.lattice.samplingBox(), clip = settings.clipBox.value_or(everything);
  int64_t inside = 0;
  for (int tile = 0; tile < caster.view().tileCount(); ++tile) {
    const TileRays rays = caster.view().rays(tile);
    for (int lane = 0; lane < kLanes; ++lane) {
      const int x = tile % caster.view().tilesX() * 4 + lane % 4,
                y = tile / caster.view().tilesX() * 4 + lane / 4;
      ASSERT_GE(rays.kBegin[lane], 0);
      if (x >= settings.width || y >= settings.height) {
        ASSERT_EQ(rays.kBegin[lane], rays.kEnd[lane]);
        continue;
      }
      const Ray ray = generator.ray(x + 0.5, y + 0.5);
      for (int32_t k = 0; k < 400; ++k) {
        const Vec3d world = ray.origin + ray.direction * ((k + 0.5) * step), p = indexFromWorld.point(world);
        const bool in = k >= rays.kBegin[lane] && k < rays.kEnd[lane];
        if (strictlyInside(box, p, 1e-6) && strictlyInside(clip, world, 1e-6)) {
          ASSERT_TRUE(in) << "sample " << k << " of pixel " << x << " " << y;
        } else if (!strictlyInside(box, p, -1e-6) || !strictlyInside(clip, world, -1e-6)) {
          ASSERT_FALSE(in) << "sample " << k << " of pixel " << x << " " << y;
        }
        inside += in;
      }
    }
  }
  EXPECT_GT(inside, 50);
}

TEST(SampleRanges, AreTheSamplesInsideTheVolume) {
  for (const auto& scene : {test::plume(ElementType::u8), test::denseNoise(ElementType::u8)})
    for (const std::string& camera : test::cameraNames()) {
      if (camera == "far") continue;
      RenderSettings settings =
          test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), 18, 13);
      expectExactRanges(scene, settings);
      if (HasFatalFailure()) FAIL() << scene.name << " " << camera;
    }
}

TEST(SampleRanges, AreTheSamplesInsideTheClipBoxToo) {
  auto scene = test::plume(ElementType::u8);
  // World space is turned against index space, so that the clip box is oblique to the bricks.
  const double c = std::cos(0.6), s = std::sin(0.6);
  scene.lattice.worldFromIndex = {{Vec3d{c, s, 0} * 0.5, Vec3d{-s, c, 0} * 0.5, Vec3d{0, 0, 0.5}}, {1, 2, 3}};
  const PointBox bounds = scene.lattice.worldBounds();
  const Vec3d size = bounds.hi - bounds.lo, centre = (bounds.lo + bounds.hi) * 0.5;
  for (const char* camera : {"iso", "inside", "ortho", "grazing"}) {
    RenderSettings settings =
        test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), 18, 13);
    settings.clipBox = PointBox{centre - size * 0.3, centre + size * 0.21};
    expectExactRanges(scene, settings);
    if (HasFatalFailure()) FAIL() << camera;
  }
}

TEST(SampleRanges, AClipBoxAroundEverythingChangesNoBit) {
  const auto scene = test::plume(ElementType::u8);
  RenderSettings settings = test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::u8));
  const auto without = test::Caster(scene, settings).cast();
  settings.clipBox = PointBox{{-1000, -1000, -1000}, {1000, 1000, 1000}};
  EXPECT_EQ(test::Caster(scene, settings).cast().pixels, without.pixels);
  settings.clipBox = PointBox{{500, 500, 500}, {1000, 1000, 1000}};
  const auto nothing = test::Caster(scene, settings).cast();
  EXPECT_EQ(nothing.pixels, std::vector<float>(nothing.pixels.size(), 0.0f));
  EXPECT_EQ(nothing.counters.samples, 0u);
}

TEST(SampleRanges, AViewThatMissesTheVolumeHasNone) {
  const auto scene = test::plume(ElementType::u8);
  RenderSettings settings = test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::u8));
  settings.camera.target = settings.camera.eye * 2.0 - settings.camera.target;  // the other way
  const test::Caster caster(scene, settings);
  for (int count : caster.sampleCounts()) ASSERT_EQ(count, 0);
}

}  // namespace
}  // namespace kairos
