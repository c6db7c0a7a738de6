#include "lod/importance.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kairos {
namespace {

const std::vector<SubvolumeView> kViews{{0.9, 10, 400, 5, 5}, {0.3, 20, 100, 50, 5}, {0.6, 40, 500, 5, 45}};

std::vector<double> evaluate(const Importance& importance) {
  std::vector<double> result(kViews.size(), -1);
  importance(kViews, result);
  return result;
}

TEST(Importance, SixWaysToWeighASubvolume_L10) {
  EXPECT_EQ(evaluate(opacityImportance()), (std::vector<double>{0.9, 0.3, 0.6}));
  EXPECT_EQ(evaluate(distanceImportance()), (std::vector<double>{1.0 / 10, 1.0 / 20, 1.0 / 40}));
  EXPECT_EQ(evaluate(areaImportance()), (std::vector<double>{400, 100, 500}));
  const auto gaze = evaluate(gazeImportance(5, 5, 20));
  EXPECT_EQ(gaze[0], 1);
  EXPECT_DOUBLE_EQ(gaze[1], 1 / (1 + 45.0 * 45 / 400));
  EXPECT_DOUBLE_EQ(gaze[2], 1 / (1 + 40.0 * 40 / 400));
  const auto mix = evaluate(mixedImportance({{distanceImportance(), 0.5}, {areaImportance(), 0.5}}));
  EXPECT_DOUBLE_EQ(mix[0], 0.5 * (0.1 / 0.175) + 0.5 * 0.4);
  EXPECT_DOUBLE_EQ(mix[1], 0.5 * (0.05 / 0.175) + 0.5 * 0.1);
  EXPECT_DOUBLE_EQ(mix[2], 0.5 * (0.025 / 0.175) + 0.5 * 0.5);
  const auto own = evaluate(perSubvolume([](const SubvolumeView& v) { return v.maxOpacity * v.x; }));
  EXPECT_EQ(own, (std::vector<double>{4.5, 15, 3}));
  EXPECT_EQ(evaluate(uniformImportance()), (std::vector<double>{1, 1, 1}));
}

TEST(Importance, UnitsDoNotMatterInAMix_L10) {
  const Importance thousandfold = perSubvolume([](const SubvolumeView& v) { return 1000 * v.projectedArea; });
  const auto a = evaluate(mixedImportance({{opacityImportance(), 1}, {areaImportance(), 2}}));
  const auto b = evaluate(mixedImportance({{opacityImportance(), 1}, {thousandfold, 2}}));
  for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-15);
}

TEST(Importance, APartThatIsZeroEverywhereAddsNothing_L10) {
  const Importance none = perSubvolume([](const SubvolumeView&) { return 0.0; });
  EXPECT_EQ(evaluate(mixedImportance({{none, 1}})), (std::vector<double>{0, 0, 0}));
}

}  // namespace
}  // namespace kairos
