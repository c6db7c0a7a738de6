#include "raycast/render_settings.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/error.h"
#include "raycast/tile_kernel.h"
#include "raycast/tile_rays.h"
#include "support/scenes.h"

namespace kairos {
namespace {

RenderSettings good() {
  const auto scene = test::plume(ElementType::u8);
  return test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::u8));
}

std::string problemAfter(const std::function<void(RenderSettings&)>& spoil) {
  RenderSettings settings = good();
  spoil(settings);
  try {
    settings.validate();
  } catch (const OptionError& e) {
    return e.what();
  }
  return "";
}

TEST(RenderSettings, GoodOnesPass) {
  EXPECT_NO_THROW(good().validate());
}

TEST(RenderSettings, EachBadOptionIsNamed) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                   kInfinity = std::numeric_limits<double>::infinity();
  const std::pair<const char*, std::function<void(RenderSettings&)>> cases[] = {
      {"--size", [](auto& s) { s.width = 0; }},
      {"--size", [](auto& s) { s.height = -4; }},
      {"--size", [](auto& s) { s.width = 40000; }},
      {"--step", [](auto& s) { s.step = 0; }},
      {"--step", [](auto& s) { s.step = -1; }},
      {"--step", [](auto& s) { s.step = 1e6; }},
      {"--step", [=](auto& s) { s.step = kNaN; }},
      {"--terminate", [](auto& s) { s.terminate = 1.01f; }},
      {"--terminate", [](auto& s) { s.terminate = -0.5f; }},
      {"--terminate", [](auto& s) { s.terminate = 0; }},
      {"--terminate", [=](auto& s) { s.terminate = float(kNaN); }},
      {"--unit-distance", [](auto& s) { s.unitDistance = -1; }},
      {"--unit-distance", [=](auto& s) { s.unitDistance = kInfinity; }},
      {"--unit-distance", [=](auto& s) { s.unitDistance = kNaN; }},
      {"--shade",
       [](auto& s) {
         s.mode = RenderMode::mip;
         s.shade = true;
       }},
      {"--aov",
       [](auto& s) {
         s.mode = RenderMode::average;
         s.depth = true;
       }},
      {"--clip-box",
       [](auto& s) {
         s.clipBox = PointBox{{0, 0, 0}, {1, 0, 1}};
       }},
      {"--clip-box",
       [=](auto& s) {
         s.clipBox = PointBox{{0, kNaN, 0}, {1, 1, 1}};
       }},
      {"--tf", [](auto& s) { s.transferFunction = {}; }},
      {"--eye", [](auto& s) { s.camera.eye = s.camera.target; }},
      {"--up", [](auto& s) { s.camera.up = s.camera.target - s.camera.eye; }},
      {"--up",
       [](auto& s) {
         s.camera.up = {0, 0, 0};
       }},
      {"--fov", [](auto& s) { s.camera.verticalFovDegrees = 180; }},
      {"--fov", [](auto& s) { s.camera.verticalFovDegrees = 0; }},
      {"--ortho",
       [](auto& s) {
         s.camera.projection = Camera::Projection::orthographic;
         s.camera.imageHeight = 0;
       }},
      {"camera", [=](auto& s) { s.camera.eye.x = kNaN; }},
  };
  int number = 0;
  for (const auto& [option, spoil] : cases) {
    const std::string problem = problemAfter(spoil);
    EXPECT_EQ(problem.rfind(option, 0), 0u)
        << "case " << number << ": " << option << ", found \"" << problem << "\"";
    ++number;
  }
}

TEST(RenderSettings, BadRangesAreNamedWhenTheTableIsBuilt) {
  const Lattice lattice = test::denseLattice(ElementType::u8, {8, 8, 8});
  RenderSettings settings = good();
  settings.range = {5, 1};
  EXPECT_THROW(settings.classification(lattice), OptionError);
  settings.range = {0, std::numeric_limits<float>::infinity()};
  EXPECT_THROW(settings.classification(lattice), OptionError);
}

TEST(RenderSettings, AnAbsurdlyFarCameraIsRefusedInsteadOfOverflowing) {
  const auto scene = test::plume(ElementType::u8);
  for (double distance : {1e12, 1e100}) {
    RenderSettings settings = good();
    settings.camera.eye = settings.camera.target + Vec3d{distance, 0, 0};
    try {
      ViewRays(settings, scene.lattice, {});
      FAIL() << distance;
    } catch (const OptionError& e) {
      EXPECT_EQ(std::string(e.what()).rfind("--eye", 0), 0u) << e.what();
    }
  }
}

TEST(RenderSettings, ChannelsAndFootprintsFollowTheMode) {
  RenderSettings settings = good();
  EXPECT_EQ(settings.channels(), 4);
  settings.depth = true;
  EXPECT_EQ(settings.channels(), 5);
  EXPECT_EQ(settings.footprintWidth(), 2);
  EXPECT_EQ(settings.footprintShift(), 0.0);
  settings.shade = true;
  EXPECT_EQ(settings.footprintWidth(), 4);
  EXPECT_EQ(settings.footprintShift(), -1.0);
  settings.filter = Filter::nearest;
  EXPECT_EQ(settings.footprintWidth(), 3);
  EXPECT_EQ(settings.footprintShift(), -0.5);
  settings.mode = RenderMode::mip;
  EXPECT_EQ(settings.channels(), 1);
}

TEST(RenderSettings, ProjectionsTakeTheOpacityUncorrected) {
  const Lattice lattice = test::denseLattice(ElementType::u8, {8, 8, 8});
  RenderSettings settings = good();
  settings.step = 0.25;
  settings.mode = RenderMode::mip;
  EXPECT_NEAR(settings.classification(lattice).classify(255.0)[3], 0.25, 1e-6);
  settings.mode = RenderMode::dvr;
  EXPECT_NEAR(settings.classification(lattice).classify(255.0)[3], 1 - std::pow(0.75, 0.25), 1e-6);
}

TEST(Isa, NamesAreThoseOfTheOption) {
  EXPECT_STREQ(name(Isa::automatic), "auto");
  EXPECT_STREQ(name(Isa::avx512), "avx512");
  EXPECT_STREQ(name(Isa::scalar), "scalar");
  for (Isa isa : supportedIsas()) EXPECT_NE(isa, Isa::scalar);
  EXPECT_EQ(bestIsa(), supportedIsas().empty() ? Isa::scalar : supportedIsas().front());
}

}  // namespace
}  // namespace kairos
