#include "lod/time_model.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace kairos {
namespace {

LodTiming timing(double slices, double fragments, double voxels, bool resident, double load, double geometry,
                 double rasterize) {
  return {{slices, fragments, voxels, resident}, load, geometry, rasterize};
}

TEST(TimeModel, LoadingCountsOnlyWhatIsNotResident_L7) {
  const LodWork absent{10, 1000, 5000, false}, present{10, 1000, 5000, true};
  EXPECT_DOUBLE_EQ(loadSeconds(2e-9, absent), 1e-5);
  EXPECT_EQ(loadSeconds(2e-9, present), 0);
}

TEST(TimeModel, PredictsByTheSlowerStageOfThePipeline_L6) {
  const LodWork work{100, 1e6, 4096, false};
  EXPECT_DOUBLE_EQ((PipelinedTimeModel{1e-9, 2e-6, 5e-6}.predict(work)), 4096e-9 + 500e-6);
  EXPECT_DOUBLE_EQ((PipelinedTimeModel{1e-9, 7e-6, 5e-6}.predict(work)), 4096e-9 + 700e-6);
  EXPECT_DOUBLE_EQ((SliceTimeModel{1e-9, 6e-6}.predict(work)), 4096e-9 + 600e-6);
  EXPECT_DOUBLE_EQ((FragmentTimeModel{1e-9, 3e-9}.predict(work)), 4096e-9 + 3e-3);
}

TEST(TimeModel, BothModelsAreRecoveredFromTimings_L6) {
  std::mt19937 random(1);
  std::vector<LodTiming> timings;
  for (int i = 0; i < 50; ++i) {
    const double slices = 1 + double(random() % 200), voxels = 100 + double(random() % 10000);
    const bool resident = random() % 2;
    timings.push_back(timing(slices, 1000 * slices, voxels, resident, resident ? 0 : 3e-9 * voxels,
                             1e-6 * slices, 4e-6 * slices));
  }
  const PipelinedTimeModel pipelined = fitPipelinedModel(timings);
  EXPECT_NEAR(pipelined.perVoxel, 3e-9, 1e-18);
  EXPECT_NEAR(pipelined.geometryPerSlice, 1e-6, 1e-15);
  EXPECT_NEAR(pipelined.rasterizePerSlice, 4e-6, 1e-15);
  EXPECT_NEAR(fitSliceModel(timings).perSlice, 5e-6, 1e-15);
  EXPECT_NEAR(fitFragmentModel(timings).perFragment, 5e-9, 1e-18);
  EXPECT_LE(relativeError(fitSliceModel(timings), timings), 1e-12);
  EXPECT_NEAR(relativeError(pipelined, timings), 0.2, 0.05) << "stages that do not overlap add up";
}

TEST(TimeModel, WithoutWorkThereIsNoCost_L6) {
  EXPECT_EQ(fitSliceModel({}).perSlice, 0);
  EXPECT_EQ(fitPipelinedModel({}).rasterizePerSlice, 0);
  EXPECT_EQ(relativeError(SliceTimeModel{}, {}), 0);
}

}  // namespace
}  // namespace kairos
