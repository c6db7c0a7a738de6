// Budgets that are an error: frames are as good as they are asked to be, and no dearer than that takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "jet_sequence.h"
#include "tcdvrm/error_goal.h"

namespace kairos::test {
namespace {

const ElementType kType = ElementType::u8;

class ErrorBudget : public testing::Test {
 protected:
  JetSequence sequence_ = jetSequence(40, 52);
  RenderSettings settings_ = jetSettings(softTransferFunction(kType));
  ExactFrames exact_ = exactFrames(sequence_, settings_);
};

TEST_F(ErrorBudget, EveryFrameIsAsGoodAsItIsAskedToBe) {
  double before = 0;
  for (const double goal : {1e-2, 3e-3, 1e-3}) {
    const auto renderer =
        makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, Budget::ofError(goal)));
    renderer->start(sequence_.start);
    double samples = 0;
    for (size_t i = 0; i < sequence_.changes.size(); ++i) {
      const Image& image = renderer->update(sequence_.changes[i]);
      ASSERT_TRUE(renderer->statistics().error);
      EXPECT_LE(renderer->statistics().error->high, goal);
      // 95 % intervals; the seed is fixed, so these frames are always the same.
      EXPECT_LE(colourError(image, exact_.images[i]).rmse, goal) << "frame " << i;
      samples += double(renderer->statistics().samples);
    }
    samples /= double(sequence_.changes.size()) * exact_.meanSamples();
    std::printf("error %g: %.0f %% of the samples\n", goal, 100 * samples);
    EXPECT_GT(samples, before) << "a smaller error costs more";
    EXPECT_LT(samples, 0.9);
    before = samples;
  }
}

TEST_F(ErrorBudget, GivesTheSameBitsAtAnyThreadCount) {
  const auto frames = [&](int threads) {
    const auto renderer = makeRenderer(sequence_.lattice, settings_,
                                       withBudget(Method::anytime, Budget::ofError(3e-3), threads));
    renderer->start(sequence_.start);
    std::vector<Image> images;
    for (const ChangedVoxels& changes : sequence_.changes) images.push_back(renderer->update(changes));
    return images;
  };
  const std::vector<Image> once = frames(1);
  for (const int threads : {2, 4}) {
    const std::vector<Image> again = frames(threads);
    for (size_t i = 0; i < once.size(); ++i)
      ASSERT_TRUE(imagesEqualBitForBit(again[i], once[i])) << threads << " threads, frame " << i;
  }
}

TEST_F(ErrorBudget, AFrameThatIsGoodEnoughIsLeftAlone) {
  const auto renderer =
      makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, Budget::ofError(1e-2)));
  renderer->start(sequence_.start);
  for (const ChangedVoxels& changes : sequence_.changes) renderer->update(changes);
  const Image last = renderer->image();
  renderer->update(noChanges(kType));
  EXPECT_EQ(renderer->statistics().samples, 0u);
  // Tiles that turn out to be exact get their exact pixels back; nothing else happens.
  EXPECT_LE(colourError(renderer->image(), exact_.images.back()).rmse,
            colourError(last, exact_.images.back()).rmse);
  ASSERT_TRUE(renderer->statistics().error);
  EXPECT_GT(renderer->statistics().error->high, 0) << "it is not exact, and says so";
  EXPECT_LE(renderer->statistics().error->high, 1e-2);
}

TEST_F(ErrorBudget, OnlyAnytimeTakesIt) {
  for (const Method method : {Method::tcdvrm, Method::tiles, Method::lowres})
    EXPECT_THROW(makeRenderer(sequence_.lattice, settings_, withBudget(method, Budget::ofError(1e-3))),
                 OptionError)
        << name(method);
}

TEST(ErrorGoal, AllowsLessOfTheModelsErrorWhereRaysSayMore) {
  const auto measured = [](double high) { return ErrorEstimate{high / 1.3, high / 1.5, high}; };
  ErrorGoal goal(0.1, 1000);  // 10 in squares
  goal.beginFrame();
  const double allowed = goal.allowed();
  EXPECT_GT(allowed, 0);
  EXPECT_LE(allowed, 10);
  EXPECT_EQ(goal.batchGain(allowed), 0);
  EXPECT_NEAR(goal.batchGain(2 * allowed), allowed / 2, 1e-12);

  EXPECT_EQ(goal.takeLeast(), 0u);
  EXPECT_FALSE(goal.reached(measured(0.2), allowed));
  EXPECT_EQ(goal.takeLeast(), 0u);
  EXPECT_NEAR(goal.allowed(), allowed / 2, 1e-12) << "no faster than that, whatever few rays say";
  EXPECT_FALSE(goal.reached(measured(0.101), allowed / 2));
  EXPECT_LT(goal.allowed(), allowed / 2);
  EXPECT_FALSE(goal.reached(measured(0.101), 0));
  EXPECT_EQ(goal.takeLeast(), 16u) << "something has to happen, even where the model expects nothing";
  EXPECT_EQ(goal.takeLeast(), 0u);
  EXPECT_FALSE(goal.reached(measured(0.101), 0));
  EXPECT_EQ(goal.takeLeast(), 32u);
  EXPECT_TRUE(goal.reached(measured(0.1), allowed / 4));

  goal.beginFrame();
  EXPECT_LT(goal.allowed(), allowed) << "the next frame starts from what this one showed";
  for (int frame = 0; frame < 50; ++frame) {
    EXPECT_TRUE(goal.reached(measured(0.05), goal.allowed()));
    goal.beginFrame();
  }
  EXPECT_GT(goal.allowed(), allowed) << "and grows again where frames are better than they need be";
  EXPECT_TRUE(goal.reached(std::nullopt, 1000));
}

}  // namespace
}  // namespace kairos::test
