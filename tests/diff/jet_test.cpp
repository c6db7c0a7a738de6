// Every frame of the bundled sequence.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "core/colour_map.h"
#include "sequences.h"

namespace kairos::test {
namespace {

const Sequence& jet() {
  static const Sequence sequence = [] {
    Sequence s{"jet1", jet1(0).lattice, {}};
    for (int step = 0; step < 100; ++step) s.steps.push_back(jet1(step).field);
    return s;
  }();
  return sequence;
}

RenderSettings jetSettings(const std::string& camera, int edge) {
  return settingsFor(jet().scene(), camera, builtInTransferFunction("inferno").stretchedTo({0, 255}), edge,
                     edge);
}

TEST(Jet, EveryFrameEqualsTheFullRender) {
  EXPECT_TRUE(framesAreEqual(jet(), jetSettings("iso", 128), withMethod(Method::segments, 2)));
}

// The grid, the steps and the element type of the paper's first data set; changes start small and grow.
TEST(Jet, HasTheShapeOfThePapersFirstDataSet_D18) {
  EXPECT_EQ(jet().lattice.domain.size(), (Vec3i{81, 49, 65}));
  EXPECT_EQ(jet().lattice.type, ElementType::u8);
  EXPECT_EQ(jet().steps.size(), 100u);
  EXPECT_THROW(jet1(100), std::runtime_error);
  const double voxels = double(jet().lattice.domain.voxelCount());
  std::vector<double> shares;
  for (const ChangedVoxels& changes : jet().changes()) shares.push_back(double(changes.count()) / voxels);
  EXPECT_GT(shares.front(), 0.002);
  EXPECT_LT(shares.front(), 0.01);
  const double most = *std::max_element(shares.begin(), shares.end());
  EXPECT_GT(most, 0.15);
  EXPECT_LT(most, 0.25);
  EXPECT_GT(shares.back(), 10 * shares.front());
}

// DF_1 to DF_t applied to V_0 are V_t, for every t.
TEST(Jet, DifferencesRebuildEveryStep_D1) {
  Field field = jet().steps.front();
  const std::vector<ChangedVoxels> changes = jet().changes();
  for (size_t step = 1; step < jet().steps.size(); ++step) {
    applyChanges(changes[step - 1], field);
    ASSERT_EQ(stateChecksum(field), stateChecksum(jet().steps[step])) << step;
  }
}

class JetViews : public testing::TestWithParam<std::string> {};

TEST_P(JetViews, EveryFrameEqualsTheFullRenderShadedOrNotAtBothSteps) {
  RenderSettings settings = jetSettings(GetParam(), 44);
  for (const double step : {1.0, 0.5})
    for (const bool shade : {false, true}) {
      settings.step = step;
      settings.shade = shade;
      EXPECT_TRUE(framesAreEqual(jet(), settings, withMethod(Method::segments, shade ? 2 : 1)))
          << step << ' ' << shade;
    }
}

TEST_P(JetViews, FramesDoNotDependOnTheFirstStep) {
  RenderSettings settings = jetSettings(GetParam(), 64);
  settings.transferFunction = opaqueTransferFunction(ElementType::u8);
  const std::vector<ChangedVoxels> changes = jet().changes();
  DifferentialRenderer all(jet().lattice, settings, withMethod(Method::segments));
  DifferentialRenderer later(jet().lattice, settings, withMethod(Method::segments, 2));
  all.start(jet().steps[0]);
  for (size_t step = 1; step < 100; ++step) {
    all.update(changes[step - 1]);
    if (step == 57) later.start(jet().steps[57]);
    if (step > 57) later.update(changes[step - 1]);
    if (step < 57) continue;
    ASSERT_TRUE(imagesEqualBitForBit(all.image(), later.image())) << step;
  }
}

INSTANTIATE_TEST_SUITE_P(Views, JetViews, testing::Values("x", "iso", "inside"),
                         [](const auto& view) { return view.param; });

TEST(Jet, AStepThatTouchesEverythingCostsNoMoreSamplesThanAFullFrame) {
  for (const bool opaque : {false, true}) {
    RenderSettings settings = jetSettings("iso", 128);
    if (opaque) settings.transferFunction = opaqueTransferFunction(ElementType::u8);
    FramePair pair(jet().lattice, settings, withMethod(Method::segments, 2));
    ASSERT_TRUE(pair.start(jet().steps[40]));
    const std::vector<ChangedVoxels> changes = jet().changes();
    uint64_t samples = 0, samplesOfFull = 0;
    for (size_t step = 41; step < 70; ++step) {
      ASSERT_TRUE(pair.update(changes[step - 1]));
      const FrameStatistics &s = pair.segments().statistics(), &f = pair.full().statistics();
      EXPECT_LE(s.samples, f.samples) << step;
      EXPECT_LE(s.segmentsRecast, f.segmentsRecast) << step;
      samples += s.samples;
      samplesOfFull += f.samples;
    }
    EXPECT_GT(samples, 0u);
    EXPECT_LE(samples, samplesOfFull);
  }
}

}  // namespace
}  // namespace kairos::test
