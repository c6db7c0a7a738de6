// Budgets of time, on a clock that runs by the work done: what the method does about slow machines and
// stalls, without a machine that is slow or stalls.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "jet_sequence.h"
#include "tcdvrm/budget_meter.h"

namespace kairos::test {
namespace {

/// Samples and segments take the time they are said to take, times `slowdown`; now and then a stall comes on
/// top.
class VirtualClock : public BudgetClock {
 public:
  double now() override { return ms_; }
  void worked(uint64_t samples, uint64_t segments) override {
    double batch = (2e-6 * double(samples) + 6e-5 * double(segments)) * slowdown;
    if (stallEvery > 0 && random_() % stallEvery == 0) batch += stall;
    longestBatch = std::max(longestBatch, batch);
    ms_ += batch;
  }

  double slowdown = 1, stall = 0, longestBatch = 0;
  uint32_t stallEvery = 0;

 private:
  double ms_ = 0;
  std::mt19937 random_{7};
};

class OnAVirtualClock : public testing::Test {
 protected:
  struct Frame {
    double ms, longestBatch;
  };

  /// Runs through the sequence, calling `before(frame)` ahead of each update.
  template <class Before>
  std::vector<Frame> run(double budget, Before&& before) {
    RendererOptions options = withBudget(Method::anytime, Budget::time(budget));
    options.clock = &clock_;
    const auto renderer = makeRenderer(sequence_.lattice, settings_, options);
    renderer->start(sequence_.start);
    std::vector<Frame> frames;
    for (size_t i = 0; i < sequence_.changes.size(); ++i) {
      before(i);
      clock_.longestBatch = 0;
      const double begin = clock_.now();
      renderer->update(sequence_.changes[i]);
      frames.push_back({clock_.now() - begin, clock_.longestBatch});
    }
    return frames;
  }

  double fullMs() {
    RendererOptions options = withBudget(Method::anytime, {});
    options.clock = &clock_;
    const auto renderer = makeRenderer(sequence_.lattice, settings_, options);
    renderer->start(sequence_.start);
    const double begin = clock_.now();
    renderer->update(sequence_.changes[0]);
    return clock_.now() - begin;
  }

  JetSequence sequence_ = jetSequence(40, 70);
  RenderSettings settings_ = jetSettings(softTransferFunction(ElementType::u8));
  VirtualClock clock_;
};

TEST_F(OnAVirtualClock, FramesTakeWhatTheyMay) {
  const double full = fullMs();
  for (const double share : {0.25, 0.5}) {
    const double budget = share * full;
    std::vector<double> deviations;
    for (const Frame& frame : run(budget, [](size_t) {}))
      deviations.push_back(std::abs(frame.ms - budget) / budget);
    std::sort(deviations.begin(), deviations.end());
    EXPECT_LE(deviations[deviations.size() * 95 / 100], 0.02) << "at " << share;
    EXPECT_LE(deviations.back(), 0.05) << "at " << share;
  }
}

TEST_F(OnAVirtualClock, AMachineThatTurnsTwiceAsSlowMakesNoFrameLateByMoreThanABatch) {
  const double budget = 0.4 * fullMs();
  const auto frames = run(budget, [&](size_t i) { clock_.slowdown = i >= 8 && i < 20 ? 2 : 1; });
  for (size_t i = 0; i < frames.size(); ++i) {
    EXPECT_LE(frames[i].ms, budget + frames[i].longestBatch) << "frame " << i;
    if (i != 8 && i != 20) {
      EXPECT_LE(frames[i].ms, 1.05 * budget) << "frame " << i;
    }
  }
}

TEST_F(OnAVirtualClock, StallsMakeNoFrameLateByMoreThanABatchAndNoOtherFrameLate) {
  const double budget = 0.4 * fullMs();
  clock_.stallEvery = 9;
  clock_.stall = budget / 3;
  int late = 0, onTime = 0;
  for (const Frame& frame : run(budget, [](size_t) {})) {
    EXPECT_LE(frame.ms, budget + frame.longestBatch);
    if (frame.longestBatch < clock_.stall) {
      EXPECT_LE(frame.ms, 1.05 * budget);
      ++onTime;
    } else {
      late += frame.ms > 1.05 * budget;
    }
  }
  EXPECT_GT(onTime, 0);
  EXPECT_GT(late, 0) << "no stall came late enough to matter";
}

TEST(CostModel, LearnsWhatSamplesAndSegmentsTake) {
  CostModel model;
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const CastWork work{1000.0 + double(random() % 100000), 10.0 + double(random() % 1000)};
    model.learn(work, 3e-6 * work.samples + 2e-4 * work.segments);
  }
  EXPECT_NEAR(model.milliseconds({1e6, 0}), 3, 0.3);
  EXPECT_NEAR(model.milliseconds({0, 1e4}), 2, 0.2);
}

TEST(CostModel, ASingleStallChangesNothingASlowMachineDoes) {
  CostModel model;
  const CastWork work{100000, 1000};
  for (int i = 0; i < 20; ++i) model.learn(work, 0.5);
  model.learn(work, 5);
  EXPECT_NEAR(model.milliseconds(work), 0.5, 0.05);
  EXPECT_GT(model.caution(), 5);
  for (int i = 0; i < 3; ++i) model.learn(work, 1);
  EXPECT_NEAR(model.milliseconds(work), 1, 0.1);
}

}  // namespace
}  // namespace kairos::test
