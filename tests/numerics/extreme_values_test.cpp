// Values at the ends of what a float can hold.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "numerics/field_oracle.h"

namespace kairos {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kMax = std::numeric_limits<float>::max();

TransferFunction scaledFunction(double scale) {
  const TransferFunction soft = test::softTransferFunction(ElementType::f32);
  return soft.stretchedTo({0, float(scale)});
}

// The plume, every value times `scale`; shading on or off.
test::Scene scaledPlume(double scale) {
  test::Scene scene = test::plume(ElementType::f32);
  for (float& v : valuesAs<float>(scene.field.values)) v = float(double(v) * scale);
  return scene;
}

RenderSettings settingsFor(const test::Scene& scene, double scale, bool shade) {
  RenderSettings settings = test::settingsFor(scene, "iso", scaledFunction(scale));
  settings.range = {0, float(scale)};
  settings.shade = shade;
  return settings;
}

TEST(NonFiniteValues, ShowAsTheBackgroundBitForBit) {
  test::Scene holes = test::plume(ElementType::f32), absent = holes;
  auto& values = valuesAs<float>(holes.field.values);
  auto& replaced = valuesAs<float>(absent.field.values);
  for (size_t i = 0; i < values.size(); i += 7) {
    values[i] = i % 3 == 0 ? kNaN : i % 3 == 1 ? kInf : -kInf;
    replaced[i] = 0;
  }
  for (RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average})
    for (bool shade : {false, true}) {
      if (shade && mode != RenderMode::dvr) continue;
      RenderSettings settings = settingsFor(holes, 1, shade);
      settings.mode = mode;
      const test::Caster a(holes, settings), b(absent, settings);
      const auto kernels = a.kernels(), same = b.kernels();
      for (size_t k = 0; k < kernels.size(); ++k)
        EXPECT_EQ(a.cast(kernels[k]).pixels, b.cast(same[k]).pixels) << kernels[k].name;
    }
}

TEST(ScaledValues, ByAPowerOfTwoChangeNoBit) {
  // Data have units: nothing may depend on whether a density is 1e-25 or 1e30. Shaded too, whose gradients
  // are squared: 1e30 squared is beyond any float.
  for (bool shade : {false, true}) {
    const test::Scene plain = test::plume(ElementType::f32);
    const test::Caster once(plain, settingsFor(plain, 1, shade));
    for (int exponent : {-100, -64, -40, 40, 64, 100}) {
      const double scale = std::exp2(exponent);
      const test::Scene scene = scaledPlume(scale);
      const test::Caster scaled(scene, settingsFor(scene, scale, shade));
      const auto kernels = once.kernels(), same = scaled.kernels();
      for (size_t k = 0; k < kernels.size(); ++k)
        EXPECT_EQ(once.cast(kernels[k]).pixels, scaled.cast(same[k]).pixels)
            << kernels[k].name << " 2^" << exponent << (shade ? " shaded" : "");
    }
  }
}

TEST(HugeValues, Of1e38WithEitherSignMatchTheReference) {
  for (bool shade : {false, true})
    for (bool signs : {false, true}) {
      test::Scene scene = scaledPlume(1e38);
      if (signs) {
        auto& values = valuesAs<float>(scene.field.values);
        for (size_t i = 0; i < values.size(); i += 2) values[i] = -values[i];
      }
      RenderSettings settings = settingsFor(scene, 1e38, shade);
      if (signs) settings.range.lo = -1e38f;
      const test::Caster caster(scene, settings);
      const auto reference = caster.reference();
      for (const auto& kernel : caster.kernels())
        EXPECT_LE(test::deviation(caster, caster.cast(kernel), reference).largest, test::kFullPrecision)
            << kernel.name << shade << signs;
    }
}

TEST(HugeValues, BeyondTheRangeNeverShowAsNaN) {
  // Fill values next to data, and next to each other with either sign: differences overflow.
  test::Scene scene = test::plume(ElementType::f32);
  auto& values = valuesAs<float>(scene.field.values);
  for (size_t i = 0; i < values.size(); i += 5)
    if (values[i] > 0) values[i] = i % 2 == 0 ? kMax : -kMax;
  for (RenderMode mode : {RenderMode::dvr, RenderMode::mip})
    for (bool shade : {false, true}) {
      if (shade && mode != RenderMode::dvr) continue;
      RenderSettings settings = settingsFor(scene, 1, shade);
      settings.mode = mode;
      const test::Caster caster(scene, settings);
      for (const auto& kernel : caster.kernels())
        for (float v : caster.cast(kernel).pixels) ASSERT_FALSE(std::isnan(v)) << kernel.name << shade;
    }
}

TEST(TinyValues, BelowANormalFloatAreNothingInAnOrdinaryRange) {
  const test::Scene tiny = scaledPlume(1e-39), none = scaledPlume(0);
  for (bool shade : {false, true}) {
    // Opacity from the range's lowest value on, so that something is seen.
    RenderSettings settings = settingsFor(none, 1, shade);
    settings.transferFunction = TransferFunction({{0, {1, 0.5, 0.2}}}, {{0, 0.01}, {1, 0.5}});
    const test::Caster a(tiny, settings), b(none, settings);
    for (const auto& kernel : a.kernels())
      EXPECT_LE(test::largestDifference(test::asDoubles(a.cast(kernel)), b.reference()), test::kFullPrecision)
          << kernel.name;
  }
}

TEST(TinyValues, ARangeTooNarrowForFloatsIsRefused) {
  const test::Scene scene = scaledPlume(1e-38);
  for (float hi : {1e-38f, 1e-40f, 5e-36f}) {
    RenderSettings settings = settingsFor(scene, 1, false);
    settings.range = {0, hi};
    try {
      settings.classification(scene.lattice);
      ADD_FAILURE() << "accepted " << hi;
    } catch (const OptionError& e) {
      EXPECT_NE(std::string(e.what()).find("--range"), std::string::npos) << e.what();
    }
  }
}

TEST(TinyValues, Of1e34AreResolvedLikeAnyOthers) {
  const test::Scene scene = scaledPlume(1e-34);
  const test::Caster caster(scene, settingsFor(scene, 1e-34, true));
  const auto reference = caster.reference();
  double seen = 0;
  for (double v : reference) seen += v;
  EXPECT_GT(seen, 10);
  for (const auto& kernel : caster.kernels())
    EXPECT_LE(test::deviation(caster, caster.cast(kernel), reference).largest, test::kFullPrecision)
        << kernel.name;
}

TEST(LargeOffset, CostsWhatTheValuesOwnFloatsCost) {
  // Pressures of 101325 that vary by a hundred: floats there are 1/128 apart. Three levels of interpolation
  // round to that, half a spacing each.
  test::Scene scene = scaledPlume(100);
  for (float& v : valuesAs<float>(scene.field.values)) v += 101325;
  scene.field.background = scene.lattice.background = 101325;
  RenderSettings settings = settingsFor(scene, 100, false);
  settings.range = {101325, 101425};
  const TransferFunction soft = test::softTransferFunction(ElementType::f32);
  settings.transferFunction = soft.stretchedTo(settings.range);
  const test::Caster caster(scene, settings);
  const auto reference = caster.reference();
  // Opacity rises by half over the range at most; the tens of samples of a ray are rounded either way.
  const double tolerance = 1.5 / 128 / 100 * 0.5;
  for (const auto& kernel : caster.kernels())
    EXPECT_LE(test::deviation(caster, caster.cast(kernel), reference).largest, tolerance) << kernel.name;
}

}  // namespace
}  // namespace kairos
