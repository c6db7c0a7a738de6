#include "core/colour_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"

namespace kairos {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

double luminance(const Vec3d& c) {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

void expectNear(const Vec3d& a, const Vec3d& b, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << "channel " << c;
}

TEST(ColourMaps, AreListedWithTheDefaultFirst) {
  EXPECT_THAT(colourMapNames(),
              ElementsAre("inferno", "magma", "plasma", "viridis", "cividis", "turbo", "coolwarm", "gray"));
}

TEST(ColourMaps, CoverTheUnitDomainWithinGamut) {
  for (const std::string& name : colourMapNames()) {
    SCOPED_TRACE(name);
    const TransferFunction tf = builtInTransferFunction(name);
    EXPECT_EQ(tf.domain(), (ValueRange{0, 1}));
    EXPECT_EQ(tf.colourPoints().front().value, 0);
    EXPECT_EQ(tf.colourPoints().back().value, 1);
    EXPECT_GE(tf.colourPoints().size(), 33u);
    for (const auto& p : tf.colourPoints())
      for (int c = 0; c < 3; ++c) EXPECT_LE(p.colour[c], 1);
  }
}

// sRGB entries 0, 77, 128, 200 and 255 of matplotlib 3.6's 256-entry maps, in linear light.
TEST(ColourMaps, MatchTheirOriginals) {
  struct Expected {
    const char* map;
    int entry;
    Vec3d colour;
  };
  const Expected expected[] = {
      {"inferno", 0, {0.0001, 0.0000, 0.0011}},    {"inferno", 77, {0.1492, 0.0089, 0.1570}},
      {"inferno", 128, {0.5005, 0.0383, 0.0891}},  {"inferno", 200, {0.9683, 0.3372, 0.0020}},
      {"inferno", 255, {0.9737, 0.9963, 0.3735}},  {"magma", 0, {0.0001, 0.0000, 0.0011}},
      {"magma", 77, {0.1304, 0.0105, 0.2165}},     {"magma", 128, {0.4717, 0.0380, 0.1919}},
      {"magma", 200, {0.9837, 0.3126, 0.1402}},    {"magma", 255, {0.9708, 0.9806, 0.5217}},
      {"plasma", 0, {0.0040, 0.0023, 0.2409}},     {"plasma", 77, {0.2827, 0.0045, 0.3666}},
      {"plasma", 128, {0.6008, 0.0638, 0.1869}},   {"plasma", 200, {0.9644, 0.3543, 0.0413}},
      {"plasma", 255, {0.8689, 0.9444, 0.0156}},   {"viridis", 0, {0.0580, 0.0004, 0.0887}},
      {"viridis", 77, {0.0347, 0.1165, 0.2670}},   {"viridis", 128, {0.0148, 0.2813, 0.2639}},
      {"viridis", 200, {0.1628, 0.6229, 0.0952}},  {"viridis", 255, {0.9847, 0.7997, 0.0182}},
      {"cividis", 0, {0.0000, 0.0164, 0.0756}},    {"cividis", 77, {0.0800, 0.0964, 0.1512}},
      {"cividis", 128, {0.2037, 0.2007, 0.1882}},  {"cividis", 200, {0.5532, 0.4581, 0.1389}},
      {"cividis", 255, {0.9903, 0.8060, 0.0389}},  {"turbo", 0, {0.0301, 0.0062, 0.0440}},
      {"turbo", 77, {0.0093, 0.6821, 0.5920}},     {"turbo", 128, {0.3719, 0.9774, 0.0445}},
      {"turbo", 200, {0.9071, 0.1326, 0.0083}},    {"turbo", 255, {0.1956, 0.0012, 0.0008}},
      {"coolwarm", 0, {0.0432, 0.0726, 0.5283}},   {"coolwarm", 77, {0.3481, 0.5199, 0.9971}},
      {"coolwarm", 128, {0.7245, 0.7188, 0.7154}}, {"coolwarm", 200, {0.8725, 0.2595, 0.1546}},
      {"coolwarm", 255, {0.4561, 0.0012, 0.0197}}, {"gray", 0, {0.0000, 0.0000, 0.0000}},
      {"gray", 77, {0.0742, 0.0742, 0.0742}},      {"gray", 128, {0.2159, 0.2159, 0.2159}},
      {"gray", 200, {0.5776, 0.5776, 0.5776}},     {"gray", 255, {1.0000, 1.0000, 1.0000}},
  };
  for (const Expected& e : expected) {
    SCOPED_TRACE(std::string(e.map) + " at " + std::to_string(e.entry));
    expectNear(builtInTransferFunction(e.map).colour(e.entry / 255.0), e.colour, 2e-3);
  }
}

TEST(ColourMaps, SequentialOnesGrowBrighterThroughout) {
  for (const char* name : {"inferno", "magma", "plasma", "viridis", "gray"}) {
    const TransferFunction tf = builtInTransferFunction(name);
    for (int i = 1; i <= 100; ++i)
      EXPECT_GT(luminance(tf.colour(i / 100.0)), luminance(tf.colour((i - 1) / 100.0)))
          << name << " at " << i;
  }
}

TEST(ColourMaps, TheDivergingOneIsBrightestInTheMiddle) {
  const TransferFunction tf = builtInTransferFunction("coolwarm");
  EXPECT_GT(luminance(tf.colour(0.5)), 2 * luminance(tf.colour(0)));
  EXPECT_GT(luminance(tf.colour(0.5)), 2 * luminance(tf.colour(1)));
  EXPECT_GT(tf.colour(0).z, tf.colour(0).x) << "cool end";
  EXPECT_GT(tf.colour(1).x, tf.colour(1).z) << "warm end";
}

TEST(ColourMaps, GreyIsAnAliasOfGray) {
  const TransferFunction grey = builtInTransferFunction("grey"), gray = builtInTransferFunction("gray");
  for (int i = 0; i <= 20; ++i) {
    const Vec3d c = grey.colour(i / 20.0);
    EXPECT_EQ(c, gray.colour(i / 20.0));
    EXPECT_EQ(c.x, c.y);
    EXPECT_EQ(c.x, c.z);
  }
}

TEST(DefaultOpacity, IsZeroAtTheBottomAndRisesSmoothly) {
  for (const std::string& name : colourMapNames()) {
    SCOPED_TRACE(name);
    const TransferFunction tf = builtInTransferFunction(name);
    EXPECT_EQ(tf.opacity(0), 0);
    EXPECT_EQ(tf.opacity(0.039), 0);
    EXPECT_NEAR(tf.opacity(1), 0.25, 0.1);
    for (int i = 5; i <= 100; ++i) {
      const double rise = tf.opacity(i / 100.0) - tf.opacity((i - 1) / 100.0);
      EXPECT_GT(rise, 0) << i;
      EXPECT_LT(rise, 0.02) << "a jump would show as a contour, at " << i;
    }
  }
}

TEST(DefaultOpacity, LetsRenderersSkipTheBackground) {
  for (const std::string& name : colourMapNames()) {
    const ClassificationTable table(builtInTransferFunction(name).stretchedTo({0, 255}), {0, 255}, 1);
    EXPECT_FALSE(table.visible(0, 5)) << name;
    EXPECT_TRUE(table.visible(0, 20)) << name;
  }
}

TEST(ColourMaps, UnknownNamesAreRefusedWithAllKnownOnes) {
  try {
    builtInTransferFunction("jet");
    FAIL() << "accepted";
  } catch (const OptionError& e) {
    EXPECT_THAT(e.what(), HasSubstr("\"jet\""));
    for (const std::string& name : colourMapNames()) EXPECT_THAT(e.what(), HasSubstr(name));
  }
}

}  // namespace
}  // namespace kairos
