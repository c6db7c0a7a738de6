// Equations 1, 3 and 4, and how the constants follow the machine.
#include "diff/time_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kairos::test {
namespace {

// A machine whose constants are known.
StepTimes timesOf(const StepWork& work, double slowdown = 1) {
  const double sectors = std::ceil(double(work.bytesRead) / 4096);
  return {sectors * 0.01 * slowdown, double(work.voxels) * 2e-6 * slowdown,
          double(work.projected) * 5e-5 * slowdown, double(work.rayPoints) * 3e-6 * slowdown};
}

TEST(TimeModel, PredictsEveryTermOfEquation1_D8) {
  TimeModel model;
  const StepWork first{100'000, 250'000, 20'000, 4'000'000}, next{50'001, 250'000, 12'345, 1'000'000};
  model.observe(first, timesOf(first));
  EXPECT_NEAR(model.constants().sector, 0.01, 1e-12);
  EXPECT_NEAR(model.constants().voxel, 2e-6, 1e-15);
  EXPECT_NEAR(model.constants().projected, 5e-5, 1e-14);
  EXPECT_NEAR(model.constants().rayPoint, 3e-6, 1e-15);
  EXPECT_NEAR(model.predict(next), timesOf(next).sum(), 1e-9);
}

TEST(TimeModel, AddsTheTimeOfCastingToTheTimeElapsed_D14) {
  TimeModel model;
  model.observe({0, 0, 0, 1000}, {0, 0, 0, 2});
  EXPECT_DOUBLE_EQ(model.predictWhenCast(7, 500), 8);
  EXPECT_DOUBLE_EQ(model.predictWhenCast(7, 0), 7);
}

TEST(TimeModel, KeepsWhatAStepDoesNotShow_D8) {
  TimeModel model;
  const StepWork first{100'000, 250'000, 20'000, 4'000'000};
  model.observe(first, timesOf(first));
  model.observe({}, {0.1, 0.1, 0.1, 0.1});  // nothing changed
  EXPECT_NEAR(model.predict(first), timesOf(first).sum(), 1e-9);
}

TEST(TimeModel, FollowsASlowerMachineOnlyWhenItCalibrates_D15) {
  const StepWork work{100'000, 250'000, 20'000, 4'000'000};
  for (const bool calibrate : {true, false}) {
    TimeModel model(calibrate);
    model.observe(work, timesOf(work));
    model.observe(work, timesOf(work, 2));
    EXPECT_NEAR(model.predict(work), timesOf(work, calibrate ? 2 : 1).sum(), 1e-9);
  }
}

}  // namespace
}  // namespace kairos::test
