#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/compositing.h"
#include "core/error.h"
#include "core/transfer_function.h"

namespace kairos {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TransferFunction white(std::vector<TransferFunction::OpacityPoint> opacities) {
  return {{{opacities.front().value, {1, 1, 1}}}, std::move(opacities)};
}

// A tent of the given half width, of opacity 0.8 at its top.
TransferFunction tent(double centre, double halfWidth) {
  return white({{0, 0}, {centre - halfWidth, 0}, {centre, 0.8}, {centre + halfWidth, 0}, {1, 0}});
}

double worstError(const ClassificationTable& table, const TransferFunction& tf, double distance) {
  const ValueRange range = table.range();
  double worst = 0;
  for (int i = 0; i <= 50000; ++i) {
    const double v = range.lo + (double(range.hi) - range.lo) * i / 50000;
    const std::array<double, 4> c = table.classify<double>(v);
    const double alpha = correctedOpacity(tf.opacity(v), distance);
    worst = std::max(worst, std::abs(c[3] - alpha));
    for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs(c[size_t(k)] - alpha * tf.colour(v)[k]));
  }
  return worst;
}

TEST(ClassificationTable, IsPremultipliedAndOpacityCorrected) {
  const TransferFunction tf({{0, {1, 0.5, 0}}, {100, {0, 0.5, 1}}}, {{0, 0}, {100, 0.9}});
  for (double distance : {0.125, 1.0, 2.0})
    EXPECT_LE(worstError({tf, {0, 100}, distance}, tf, distance), 2e-3);
  const auto c = ClassificationTable(tf, {0, 100}, 0.5).classify(100.0);
  EXPECT_NEAR(c[3], 1 - std::sqrt(0.1), 1e-6);
  EXPECT_NEAR(c[2], c[3], 1e-6);
  EXPECT_NEAR(c[1], 0.5 * c[3], 1e-6);
}

TEST(ClassificationTable, TakesOnlyAsManyNodesAsTheFunctionNeeds) {
  const std::pair<TransferFunction, int> functions[] = {
      {white({{0, 0}, {1, 0.9}}), 256}, {tent(0.4324, 0.4), 1024}, {tent(0.4324, 0.08), 4096}};
  for (const auto& [tf, nodes] : functions) {
    const ClassificationTable table(tf, {0, 1}, 1);
    EXPECT_EQ(table.nodeCount(), nodes);
    EXPECT_LE(worstError(table, tf, 1), 2e-3) << nodes;
  }
}

TEST(ClassificationTable, KeepsNarrowBandsAtFineSteps) {
  // Over a 64th of the distance the band's opacity is 64 times smaller; it is no less visible in the image.
  const TransferFunction band = white({{0, 0}, {0.43, 0}, {0.432, 0.3}, {0.434, 0}, {1, 0}});
  const ClassificationTable coarse(band, {0, 1}, 1), fine(band, {0, 1}, 1.0 / 64);
  EXPECT_GE(fine.nodeCount(), coarse.nodeCount());
  EXPECT_NEAR(64 * std::log1p(-fine.classify(0.432)[3]), std::log1p(-coarse.classify(0.432)[3]), 0.01);
}

TEST(ClassificationTable, AStepGetsTheFinestTable) {
  const ClassificationTable table(white({{0, 0}, {0.5, 0}, {0.5, 1}, {1, 1}}), {0, 1}, 1);
  EXPECT_EQ(table.nodeCount(), 4096);
  EXPECT_EQ(table.classify(0.5 - 2.0 / 4095)[3], 0);
  EXPECT_EQ(table.classify(0.5 + 2.0 / 4095)[3], 1);
}

TEST(ClassificationTable, PadsItsEndSoThatTheLastNodeCanBeInterpolated) {
  const ClassificationTable table(white({{0, 0.1}, {1, 0.7}}), {0, 1}, 1);
  const auto& last = table.nodes()[table.nodeCount() - 1];
  const auto& pad = table.nodes()[table.nodeCount()];
  EXPECT_EQ(last.a, pad.a);
  EXPECT_EQ(last.r, pad.r);
}

TEST(ClassificationTable, ValuesOutsideTheRangeClassifyAsItsEnds) {
  const ClassificationTable table(white({{0, 0.1}, {1, 0.7}}), {0, 1}, 1);
  EXPECT_EQ(table.classify(-5.0f), table.classify(0.0f));
  EXPECT_EQ(table.classify(7.0f), table.classify(1.0f));
  EXPECT_EQ(table.classify(-kInfinity), table.classify(0.0f));
  EXPECT_EQ(table.classify(kInfinity), table.classify(1.0f));
}

TEST(ClassificationTable, ReadsFloatsAndDoublesAlike) {
  const ClassificationTable table(tent(0.4, 0.3), {0, 1}, 0.5);
  for (int i = 0; i <= 1000; ++i) {
    const auto f = table.classify(float(i) / 1000);
    const auto d = table.classify(double(float(i) / 1000));
    for (size_t c = 0; c < 4; ++c) EXPECT_NEAR(double(f[c]), d[c], 1e-4);
  }
}

TEST(ClassificationTable, ARangeOfOneValueIsAConstant) {
  const ClassificationTable table(white({{0, 0}, {10, 1}}), {5, 5}, 1);
  EXPECT_EQ(table.classify(5.0f)[3], 0.5f);
  EXPECT_EQ(table.classify(900.0f)[3], 0.5f);
  EXPECT_TRUE(table.visible(5, 5));
}

TEST(ClassificationTable, RefusesImpossibleRangesAndDistances) {
  const TransferFunction tf = white({{0, 0}, {1, 1}});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const ValueRange& range :
       {ValueRange{1, 0}, ValueRange{nan, 1}, ValueRange{0, nan}, ValueRange{0, kInfinity}})
    EXPECT_THROW(ClassificationTable(tf, range, 1), OptionError);
  for (double distance : {0.0, -1.0, double(nan), double(kInfinity)})
    EXPECT_THROW(ClassificationTable(tf, {0, 1}, distance), OptionError);
}

struct VisibilityCase {
  const char* name;
  TransferFunction tf;
  ValueRange range;
};

std::vector<VisibilityCase> visibilityCases() {
  return {{"window", white({{0, 0}, {90, 0}, {100, 0.5}, {120, 0.5}, {121, 0}, {255, 0}}), {0, 255}},
          {"two spikes",
           white({{0, 0}, {49, 0}, {50, 1}, {51, 0}, {200, 0}, {201, 1e-9}, {202, 0}, {255, 0}}),
           {0, 255}},
          {"narrow range", white({{0, 0}, {100, 0}, {110, 0.3}, {255, 0.3}}), {80, 130}},
          {"low end", white({{0, 0.4}, {30, 0}, {255, 0}}), {0, 255}},
          {"nothing", white({{0, 0}, {255, 0}}), {0, 255}},
          {"everything", white({{0, 0.1}, {255, 1}}), {0, 255}}};
}

constexpr int kPerUnit = 16;  // probes between neighbouring integers
constexpr int kLowest = -20, kHighest = 275;

// For all integer ranges, compares visible() with what classify() gives at closely spaced values.
template <class Check>
void forAllRanges(const ClassificationTable& table, Check check) {
  const int probes = (kHighest - kLowest) * kPerUnit + 1;
  std::vector<int> visibleBefore(size_t(probes) + 1, 0);
  for (int i = 0; i < probes; ++i) {
    const float v = float(kLowest) + float(i) / kPerUnit;
    visibleBefore[size_t(i) + 1] = visibleBefore[size_t(i)] + (table.classify(v)[3] > 0 ? 1 : 0);
  }
  const auto countIn = [&](int lo, int hi) {
    const int from = std::clamp((lo - kLowest) * kPerUnit, 0, probes),
              to = std::clamp((hi - kLowest) * kPerUnit + 1, 0, probes);
    return visibleBefore[size_t(to)] - visibleBefore[size_t(from)];
  };
  for (int lo = kLowest; lo <= kHighest; ++lo)
    for (int hi = lo; hi <= kHighest; ++hi) check(lo, hi, countIn);
}

TEST(VisibleRange, NeverMissesAVisibleValue) {
  for (const VisibilityCase& c : visibilityCases()) {
    SCOPED_TRACE(c.name);
    const ClassificationTable table(c.tf, c.range, 1);
    forAllRanges(table, [&](int lo, int hi, const auto& countIn) {
      if (countIn(lo, hi) > 0) {
        ASSERT_TRUE(table.visible(float(lo), float(hi))) << lo << " to " << hi;
      }
    });
  }
}

TEST(VisibleRange, AnswersNoWheneverNothingIsVisibleNearby) {
  for (const VisibilityCase& c : visibilityCases()) {
    SCOPED_TRACE(c.name);
    const ClassificationTable table(c.tf, c.range, 1);
    const int slack = int(std::ceil(4.0f / table.scale()));  // the widening, rounded up to whole values
    int64_t invisible = 0;
    forAllRanges(table, [&](int lo, int hi, const auto& countIn) {
      if (countIn(lo - slack, hi + slack) > 0) return;
      ++invisible;
      ASSERT_FALSE(table.visible(float(lo), float(hi))) << lo << " to " << hi;
    });
    EXPECT_EQ(invisible > 0, std::string(c.name) != "everything");
  }
}

TEST(VisibleRange, FindsWindowsNarrowerThanTheDistanceBetweenItsEnds) {
  const ClassificationTable table(tent(0.5, 0.01), {0, 1}, 1);
  EXPECT_TRUE(table.visible(0, 1));
  EXPECT_TRUE(table.visible(0.5f, 0.5f));
  EXPECT_FALSE(table.visible(0, 0.45f));
  EXPECT_FALSE(table.visible(0.55f, 1));
}

TEST(VisibleRange, HoldsForRandomFloatRanges) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
  const ClassificationTable table(tent(0.6, 0.002), {0, 1}, 0.25);
  int invisible = 0;
  for (int i = 0; i < 20000; ++i) {
    const float a = uniform(random), b = a + 0.05f * uniform(random);
    const float lo = std::min(a, b), hi = std::max(a, b);
    bool any = false;
    for (int k = 0; k <= 16; ++k) any |= table.classify(std::lerp(lo, hi, float(k) / 16))[3] > 0;
    if (any) {
      ASSERT_TRUE(table.visible(lo, hi)) << lo << " to " << hi;
    }
    invisible += !table.visible(lo, hi);
  }
  EXPECT_GT(invisible, 10000);
}

TEST(VisibleRange, ValuesBeyondFirstAndLastVisibleClassifyToZero) {
  for (const VisibilityCase& c : visibilityCases()) {
    SCOPED_TRACE(c.name);
    const ClassificationTable table(c.tf, c.range, 1);
    for (int i = kLowest * 64; i <= kHighest * 64; ++i) {
      const float v = float(i) / 64;
      if (v < table.firstVisible() || v > table.lastVisible()) {
        ASSERT_EQ(table.classify(v)[3], 0) << v;
      }
    }
  }
}

TEST(VisibleRange, FirstAndLastVisibleEncloseTheWindowTightly) {
  const ClassificationTable window(white({{0, 0}, {90, 0}, {100, 0.5}, {120, 0.5}, {140, 0}, {255, 0}}),
                                   {0, 255}, 1);
  EXPECT_LE(window.firstVisible(), 90);
  EXPECT_GT(window.firstVisible(), 87);
  EXPECT_GE(window.lastVisible(), 140);
  EXPECT_LT(window.lastVisible(), 143);
}

TEST(VisibleRange, AnInvisibleFunctionHasAnEmptyVisibleRange) {
  const ClassificationTable table(white({{0, 0}, {1, 0}}), {0, 1}, 1);
  EXPECT_FALSE(table.visible(-kInfinity, kInfinity));
  EXPECT_EQ(table.firstVisible(), kInfinity);
  EXPECT_EQ(table.lastVisible(), -kInfinity);
}

TEST(VisibleRange, UniformSpaceAtTheStartOfARampIsInvisible) {
  const ClassificationTable ramp(white({{0, 0}, {255, 1}}), {0, 255}, 1);
  EXPECT_FALSE(ramp.visible(0, 0));
  EXPECT_FALSE(ramp.visible(-3, -3));
  EXPECT_TRUE(ramp.visible(0, 0.5f));
  EXPECT_TRUE(ramp.visible(1, 1));
  const ClassificationTable raised(white({{0, 0.1}, {255, 1}}), {0, 255}, 1);
  EXPECT_TRUE(raised.visible(0, 0));
}

TEST(VisibleRange, AFunctionVisibleAtItsEndsIsVisibleBeyondThem) {
  const ClassificationTable table(white({{0, 0.2}, {1, 0.2}}), {0, 1}, 1);
  EXPECT_TRUE(table.visible(-100, -50));
  EXPECT_TRUE(table.visible(50, 100));
  EXPECT_EQ(table.firstVisible(), -kInfinity);
  EXPECT_EQ(table.lastVisible(), kInfinity);
}

}  // namespace
}  // namespace kairos
