#include "core/image_difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace kairos {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Image uniform(int width, int height, float r, float g, float b, float a = 1) {
  Image image(width, height, 4);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) std::copy_n(std::array{r, g, b, a}.data(), 4, image.pixel(x, y));
  return image;
}

// Coloured waves, and the same dimmed, with a checkerboard in red, a dark square and a bright dot.
constexpr int kWidth = 56, kHeight = 40;

Image waves() {
  Image image(kWidth, kHeight, 4);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      float* p = image.pixel(x, y);
      for (int c = 0; c < 3; ++c) p[c] = float(0.5 + 0.5 * std::sin(0.31 * x + 0.17 * y * (c + 1) + c));
      p[3] = 1;
    }
  return image;
}

Image disturbedWaves() {
  Image image = waves();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      float* p = image.pixel(x, y);
      for (int c = 0; c < 3; ++c) p[c] = float(p[c] * 0.8 + (c == 0 ? 0.2 * ((x / 6 + y / 5) % 2) : 0.0));
      if (x >= 40 && x < 48 && y >= 8 && y < 16) std::fill_n(p, 3, 0.05f);
    }
  std::fill_n(image.pixel(30, 20), 3, 1.0f);
  return image;
}

TEST(ImageDifference, OfEqualImagesIsNone) {
  const ImageDifference d = compareImages(waves(), waves());
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.max, 0);
  EXPECT_EQ(d.psnr, kInfinity);
  EXPECT_EQ(d.ssim, 1);
  EXPECT_EQ(d.flip, 0);
}

TEST(ImageDifference, OfAConstantOffsetIsExact) {
  const ImageDifference d = compareImages(uniform(20, 10, 0.25f, 0.25f, 0.25f, 0.25f),
                                          uniform(20, 10, 0.375f, 0.375f, 0.375f, 0.375f));
  EXPECT_DOUBLE_EQ(d.rmse, 0.125);
  EXPECT_DOUBLE_EQ(d.max, 0.125);
  EXPECT_DOUBLE_EQ(d.psnr, -20 * std::log10(0.125));
}

TEST(ImageDifference, CountsAlphaInTheErrorButNotInWhatIsSeen) {
  const ImageDifference d =
      compareImages(uniform(16, 16, 0.1f, 0.2f, 0.3f, 0.5f), uniform(16, 16, 0.1f, 0.2f, 0.3f, 1));
  EXPECT_DOUBLE_EQ(d.rmse, 0.25) << "half in one of four channels";
  EXPECT_DOUBLE_EQ(d.max, 0.5);
  EXPECT_EQ(d.ssim, 1);
  EXPECT_EQ(d.flip, 0);
}

TEST(ImageDifference, MaximumFindsASinglePixel) {
  const Image a = uniform(64, 32, 0, 0, 0);
  Image b = a;
  b.pixel(63, 31)[2] = -0.75f;
  const ImageDifference d = compareImages(a, b);
  EXPECT_EQ(d.max, 0.75);
  EXPECT_DOUBLE_EQ(d.rmse, 0.75 / std::sqrt(64 * 32 * 4.0));
}

// The values below come from an independent implementation in numpy, with two-dimensional filters, of the
// papers' definitions (FLIP also after the constants of its authors' implementation).
TEST(ImageDifference, MatchesAnIndependentImplementation) {
  const ImageDifference d = compareImages(waves(), disturbedWaves());
  EXPECT_NEAR(d.rmse, 0.1354727784, 1e-7);
  EXPECT_NEAR(d.max, 0.9920325028, 1e-6);
  EXPECT_NEAR(d.ssim, 0.8885944829, 1e-6);
  EXPECT_NEAR(d.flip, 0.4234690798, 1e-5);
}

TEST(Flip, MapMatchesAnIndependentImplementationAtInteriorAndBorderPixels) {
  const Image map = flipMap(waves(), disturbedWaves());
  ASSERT_EQ(map.channels, 1);
  EXPECT_NEAR(*map.pixel(0, 0), 0.38616430, 1e-5);
  EXPECT_NEAR(*map.pixel(30, 20), 0.56932878, 1e-5);
  EXPECT_NEAR(*map.pixel(44, 12), 0.97524090, 1e-5);
  EXPECT_NEAR(*map.pixel(55, 39), 0.36986526, 1e-5);
  EXPECT_NEAR(*map.pixel(20, 15), 0.31910693, 1e-5);
}

double flipOfUniform(float r, float g, float b, float r2, float g2, float b2) {
  return compareImages(uniform(16, 16, r, g, b), uniform(16, 16, r2, g2, b2)).flip;
}

TEST(Flip, OfUniformColoursIsTheirRedistributedHyab) {
  EXPECT_NEAR(flipOfUniform(0, 0, 1, 0, 1, 0), 1, 1e-4) << "blue against green defines the largest error";
  EXPECT_NEAR(flipOfUniform(0, 0, 0, 1, 1, 1), 0.9673798, 1e-4);
  EXPECT_NEAR(flipOfUniform(0, 0, 0, 0, 1, 0), 0.9969694, 1e-4);
  EXPECT_NEAR(flipOfUniform(0, 0, 0, 0.01f, 0.01f, 0.01f), 0.2676983, 1e-4);
}

TEST(Flip, GrowsWithTheError) {
  double last = 0;
  for (float v : {0.501f, 0.51f, 0.55f, 0.6f, 0.8f, 1.0f}) {
    const double flip = flipOfUniform(0.5f, 0.5f, 0.5f, v, v, v);
    EXPECT_GT(flip, last) << v;
    last = flip;
  }
}

TEST(Flip, IsSymmetric) {
  const Image a = waves(), b = disturbedWaves();
  EXPECT_EQ(flipMap(a, b), flipMap(b, a));
  EXPECT_DOUBLE_EQ(compareImages(a, b).ssim, compareImages(b, a).ssim);
}

TEST(Flip, StaysInTheUnitRangeForWhateverValues) {
  Image a = waves(), b = waves();
  for (size_t i = 0; i < b.data.size(); ++i) b.data[i] = (i % 3 == 0 ? -50.0f : 4.0f) * b.data[i];
  a.data[40] = std::numeric_limits<float>::infinity();
  for (float v : flipMap(a, b).data) {
    EXPECT_GE(v, 0);
    EXPECT_LE(v, 1);
  }
}

TEST(ImageDifference, SeesOnlyWhatTheDisplayShows) {
  const ImageDifference d = compareImages(uniform(16, 16, -1, 2, 0.5f), uniform(16, 16, -3, 9, 0.5f));
  EXPECT_EQ(d.flip, 0);
  EXPECT_EQ(d.ssim, 1);
  EXPECT_EQ(d.max, 7);
}

TEST(ImageDifference, NanIsInfinitelyFarFromEverythingItselfIncluded) {
  const Image a = waves();
  Image b = a;
  b.pixel(7, 9)[1] = std::numeric_limits<float>::quiet_NaN();
  for (const Image& other : {a, b}) {
    const ImageDifference d = compareImages(b, other);
    EXPECT_EQ(d.rmse, kInfinity);
    EXPECT_EQ(d.max, kInfinity);
    EXPECT_EQ(d.psnr, -kInfinity);
    EXPECT_TRUE(std::isfinite(d.ssim));
    EXPECT_GT(d.flip, 0);
    EXPECT_EQ(*flipMap(b, other).pixel(7, 9), 1);
  }
}

TEST(ImageDifference, HandlesImagesSmallerThanEveryFilter) {
  for (const auto& [width, height] : {std::pair{1, 1}, std::pair{3, 200}, std::pair{10, 10}}) {
    const ImageDifference d = compareImages(uniform(width, height, 0, 0, 0), uniform(width, height, 1, 1, 1));
    EXPECT_NEAR(d.flip, 0.9673798, 1e-4);
    EXPECT_NEAR(d.ssim, 1e-4 / (1 + 1e-4), 1e-9) << "the luminance term alone";
  }
}

TEST(ImageDifference, OfEmptyImagesIsNone) {
  const ImageDifference d = compareImages(Image(0, 0, 4), Image(0, 0, 4));
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.ssim, 1);
  EXPECT_EQ(d.flip, 0);
}

TEST(ImageDifference, RefusesUnequalSizesNamingBoth) {
  for (const auto compare : {+[](const Image&a, const Image&b) { (void)compareImages(a, b); },
                             +[](const Image&a, const Image&b) { (void)flipMap(a, b); }}) {
    try {
      compare(Image(640, 480, 4), Image(480, 640, 4));
      ADD_FAILURE() << "accepted";
    } catch (const OptionError& e) {
      EXPECT_THAT(e.what(), AllOf(HasSubstr("640x480"), HasSubstr("480x640")));
    }
  }
}

TEST(ImageDifference, RefusesImagesWithoutFourChannels) {
  EXPECT_THROW(compareImages(Image(8, 8, 3), Image(8, 8, 3)), OptionError);
  EXPECT_THROW(compareImages(Image(8, 8, 4), Image(8, 8, 1)), OptionError);
}

}  // namespace
}  // namespace kairos
