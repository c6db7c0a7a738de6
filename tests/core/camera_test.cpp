#include "core/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace kairos {
namespace {

using Projection = Camera::Projection;
using testing::HasSubstr;

void expectNear(const Vec3d& a, const Vec3d& b, double tolerance = 1e-12) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], tolerance) << "axis " << axis;
}

Camera cameraOf(Projection projection) {
  Camera camera;
  camera.eye = {3, -8, 2};
  camera.target = {0.5, 1, -1};
  camera.up = {0.1, 0.2, 1};
  camera.projection = projection;
  camera.verticalFovDegrees = 50;
  camera.imageHeight = 6;
  return camera;
}

class BothProjections : public testing::TestWithParam<Projection> {};
INSTANTIATE_TEST_SUITE_P(Camera, BothProjections,
                         testing::Values(Projection::perspective, Projection::orthographic),
                         [](const auto& p) {
                           return p.param == Projection::perspective ? "Perspective" : "Orthographic";
                         });

TEST_P(BothProjections, CentreRayRunsFromEyeToTarget) {
  const Camera camera = cameraOf(GetParam());
  const RayGenerator rays(camera, 37, 20);
  const Ray ray = rays.ray(18.5, 10);
  expectNear(ray.origin, camera.eye);
  expectNear(ray.direction, normalized(camera.target - camera.eye));
}

TEST_P(BothProjections, CentrePixelOfAnOddImageIsTheCentreRay) {
  const Camera camera = cameraOf(GetParam());
  expectNear(RayGenerator(camera, 5, 3).ray(2 + 0.5, 1 + 0.5).direction,
             normalized(camera.target - camera.eye));
}

TEST_P(BothProjections, RowZeroIsTheTopAndColumnZeroTheLeft) {
  Camera camera;  // looks along -z with y up: x runs to the right
  camera.eye = {0, 0, 5};
  camera.projection = GetParam();
  const RayGenerator rays(camera, 64, 64);
  const auto at = [](const Ray& r) { return r.origin + r.direction * 5; };
  EXPECT_GT(at(rays.ray(32, 0.5)).y, 0.1);
  EXPECT_LT(at(rays.ray(32, 63.5)).y, -0.1);
  EXPECT_LT(at(rays.ray(0.5, 32)).x, -0.1);
  EXPECT_GT(at(rays.ray(63.5, 32)).x, 0.1);
}

TEST_P(BothProjections, FrameIsOrthonormalAndRightHanded) {
  const RayGenerator rays(cameraOf(GetParam()), 100, 60);
  for (const Vec3d& v : {rays.right(), rays.up(), rays.forward()}) EXPECT_NEAR(length(v), 1, 1e-12);
  expectNear(cross(rays.right(), rays.up()), -rays.forward());
  EXPECT_NEAR(dot(rays.right(), Vec3d{0.1, 0.2, 1}), 0, 1e-12) << "right is level";
  EXPECT_GT(dot(rays.up(), Vec3d{0.1, 0.2, 1}), 0);
}

TEST_P(BothProjections, DirectionsHaveUnitLength) {
  const RayGenerator rays(cameraOf(GetParam()), 100, 60);
  for (int y = 0; y <= 60; y += 15)
    for (int x = 0; x <= 100; x += 20) EXPECT_NEAR(length(rays.ray(x, y).direction), 1, 1e-14);
}

TEST(Camera, PerspectiveSpansTheVerticalFieldOfView) {
  const RayGenerator rays(cameraOf(Projection::perspective), 300, 100);
  const double cosine = dot(rays.ray(150, 0).direction, rays.ray(150, 100).direction);
  EXPECT_NEAR(std::acos(cosine) * 180 / std::numbers::pi, 50, 1e-9);
}

TEST(Camera, PerspectiveRaysShareTheEye) {
  const Camera camera = cameraOf(Projection::perspective);
  const RayGenerator rays(camera, 300, 100);
  EXPECT_EQ(rays.ray(0, 0).origin, camera.eye);
  EXPECT_EQ(rays.ray(271, 3.25).origin, camera.eye);
}

TEST(Camera, OrthographicImageIsImageHeightTallWithSquarePixels) {
  const RayGenerator rays(cameraOf(Projection::orthographic), 300, 100);
  EXPECT_NEAR(length(rays.ray(150, 0).origin - rays.ray(150, 100).origin), 6, 1e-12);
  EXPECT_NEAR(length(rays.ray(0, 50).origin - rays.ray(300, 50).origin), 18, 1e-12);
  EXPECT_EQ(rays.ray(0, 0).direction, rays.ray(300, 100).direction);
}

struct FittedCase {
  std::string view;
  double aspect;
  bool perspective;
};

std::vector<FittedCase> fittedCases() {
  std::vector<FittedCase> cases;
  for (const char* view : {"x", "-x", "y", "-y", "z", "-z", "iso"})
    for (double aspect : {1.0, 16.0 / 9, 0.4})
      for (bool perspective : {true, false}) cases.push_back({view, aspect, perspective});
  return cases;
}

Camera fitted(const FittedCase& c, const PointBox& box, double fov) {
  return c.perspective ? fittedCamera(c.view, box, fov, c.aspect)
                       : fittedOrthographicCamera(c.view, box, c.aspect);
}

// Image position of a world point in [-1, 1]^2, from the corner rays alone; z is the distance in front of the
// eye.
Vec3d imagePosition(const RayGenerator& rays, const Camera& camera, int width, const Vec3d& world) {
  const Ray corner = rays.ray(width, 0);
  const Vec3d d = world - camera.eye;
  const double depth = dot(d, rays.forward());
  const bool perspective = camera.projection == Projection::perspective;
  const Vec3d extent = perspective ? corner.direction * (depth / dot(corner.direction, rays.forward()))
                                   : corner.origin - camera.eye;
  return {dot(d, rays.right()) / dot(extent, rays.right()), dot(d, rays.up()) / dot(extent, rays.up()),
          depth};
}

TEST(FittedView, SeesAllCornersInsideTheImageAndFillsIt) {
  const PointBox boxes[] = {
      {{0, 0, 0}, {1, 1, 1}}, {{-3, 5, 100}, {40, 5.5, 101}}, {{-1, -1, -1}, {1, 1, -1}}};
  for (const FittedCase& c : fittedCases())
    for (const PointBox& box : boxes)
      for (double fov : {5.0, 30.0, 120.0}) {
        SCOPED_TRACE(c.view + " aspect " + std::to_string(c.aspect) + " fov " + std::to_string(fov));
        const Camera camera = fitted(c, box, fov);
        const int height = 200, width = int(200 * c.aspect);
        const RayGenerator rays(camera, width, height);
        double widest = 0;
        for (int i = 0; i < 8; ++i) {
          const Vec3d p = imagePosition(
              rays, camera, width,
              {(i & 1 ? box.hi : box.lo).x, (i & 2 ? box.hi : box.lo).y, (i & 4 ? box.hi : box.lo).z});
          EXPECT_GT(p.z, 0);
          EXPECT_LE(std::max(std::abs(p.x), std::abs(p.y)), 1.0);
          widest = std::max({widest, std::abs(p.x), std::abs(p.y)});
        }
        EXPECT_GT(widest, 0.9) << "the box should fill the image in one direction";
      }
}

TEST(FittedView, LooksFromTheNamedSide) {
  const PointBox box{{1, 2, 3}, {5, 4, 9}};
  const Vec3d centre{3, 3, 6};
  const std::pair<const char*, Vec3d> sides[] = {{"x", {1, 0, 0}},
                                                 {"-x", {-1, 0, 0}},
                                                 {"y", {0, 1, 0}},
                                                 {"-y", {0, -1, 0}},
                                                 {"z", {0, 0, 1}},
                                                 {"-z", {0, 0, -1}},
                                                 {"iso", normalized({1, -1.5, 0.8})}};
  for (const auto& [view, from] : sides)
    for (const Camera& camera : {fittedCamera(view, box, 30, 1), fittedOrthographicCamera(view, box, 1)}) {
      expectNear(normalized(camera.eye - centre), from);
      expectNear(camera.target, centre);
      EXPECT_EQ(camera.up, from.z * from.z == 1 ? (Vec3d{0, 1, 0}) : (Vec3d{0, 0, 1}));
    }
}

TEST(FittedView, OfAPointIsStillAValidCamera) {
  const PointBox point{{2, 2, 2}, {2, 2, 2}};
  EXPECT_NO_THROW(fittedCamera("iso", point, 30, 1).validate());
  EXPECT_NO_THROW(fittedOrthographicCamera("iso", point, 1).validate());
}

TEST(FittedView, UnknownNamesAreRefusedWithTheKnownOnes) {
  for (const char* name : {"", "w", "--x", "xy", "-", "ISO", "-iso"}) {
    try {
      fittedCamera(name, {{0, 0, 0}, {1, 1, 1}}, 30, 1);
      ADD_FAILURE() << "accepted \"" << name << "\"";
    } catch (const OptionError& e) {
      EXPECT_THAT(e.what(), HasSubstr("\"" + std::string(name) + "\""));
      EXPECT_THAT(e.what(), HasSubstr("-z or iso"));
    }
  }
}

TEST(Camera, RefusesWhatDefinesNoView) {
  const auto refused = [](auto change) {
    Camera camera;
    change(camera);
    EXPECT_THROW(camera.validate(), OptionError);
    EXPECT_THROW(RayGenerator(camera, 8, 8), OptionError);
  };
  refused([](Camera& c) { c.target = c.eye; });
  refused([](Camera& c) { c.up = {0, 0, -3}; });
  refused([](Camera& c) { c.up = {0, 0, 0}; });
  refused([](Camera& c) { c.eye.x = std::numeric_limits<double>::quiet_NaN(); });
  for (double fov : {0.0, -10.0, 180.0, 1e9, std::numeric_limits<double>::quiet_NaN()})
    refused([&](Camera& c) { c.verticalFovDegrees = fov; });
  for (double imageHeight : {0.0, -1.0, std::numeric_limits<double>::infinity()})
    refused([&](Camera& c) { c.projection = Projection::orthographic, c.imageHeight = imageHeight; });
}

TEST(Camera, RefusesImagesWithoutPixels) {
  EXPECT_THROW(RayGenerator(Camera{}, 0, 8), OptionError);
  EXPECT_THROW(RayGenerator(Camera{}, 8, -1), OptionError);
  EXPECT_NO_THROW(RayGenerator(Camera{}, 1, 1));
}

}  // namespace
}  // namespace kairos
