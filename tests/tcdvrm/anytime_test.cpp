// The method `anytime`: exact where the budget suffices, near to it elsewhere, and honest about how near.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/error.h"
#include "jet_sequence.h"

namespace kairos::test {
namespace {

const ElementType kType = ElementType::u8;

class Anytime : public testing::Test {
 protected:
  Budget share(double ofFull) const { return Budget::ofSamples(uint64_t(ofFull * exact_.meanSamples())); }

  JetSequence sequence_ = jetSequence(40, 52);
  RenderSettings settings_ = jetSettings(softTransferFunction(kType));
  ExactFrames exact_ = exactFrames(sequence_, settings_);
};

TEST_F(Anytime, EveryFrameThatFitsTheBudgetIsExact) {
  for (const Budget budget : {Budget{}, share(3)}) {
    const auto renderer = makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, budget));
    renderer->start(sequence_.start);
    for (size_t i = 0; i < sequence_.changes.size(); ++i) {
      EXPECT_TRUE(imagesEqualBitForBit(renderer->update(sequence_.changes[i]), exact_.images[i]));
      ASSERT_TRUE(renderer->statistics().error);
      EXPECT_EQ(renderer->statistics().error->high, 0);
    }
  }
}

TEST_F(Anytime, SpendsTheSamplesItIsGivenAndNoMore) {
  const Budget budget = share(0.2);
  const auto renderer = makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, budget));
  renderer->start(sequence_.start);
  for (const ChangedVoxels& changes : sequence_.changes) {
    renderer->update(changes);
    EXPECT_NEAR(double(renderer->statistics().samples), double(budget.samples),
                0.03 * double(budget.samples));
  }
}

TEST_F(Anytime, OnceChangesStopTheImageBecomesExactWithinAFewFrames) {
  const double ofFull = 0.2;
  const auto renderer =
      makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, share(ofFull)));
  renderer->start(sequence_.start);
  for (const ChangedVoxels& changes : sequence_.changes) renderer->update(changes);
  ASSERT_FALSE(imagesEqualBitForBit(renderer->image(), exact_.images.back()));
  int frames = 0;
  double before = 1;
  while (!imagesEqualBitForBit(renderer->image(), exact_.images.back()) && frames < 50) {
    renderer->update(noChanges(kType));
    ++frames;
    const double rmse = colourError(renderer->image(), exact_.images.back()).rmse;
    EXPECT_LE(rmse, before * 1.001) << "frame " << frames;
    before = rmse;
  }
  RecordProperty("frames", frames);
  std::printf("exact after %d frames without changes, each with %.0f %% of a full frame's samples\n", frames,
              100 * ofFull);
  EXPECT_GT(frames, 1);
  EXPECT_LE(frames, int(std::ceil(1 / ofFull)) + 2);
  EXPECT_EQ(renderer->statistics().error->high, 0);
  renderer->update(noChanges(kType));
  EXPECT_EQ(renderer->statistics().samples, 0u) << "an exact image needs nothing more";
}

TEST_F(Anytime, ASampleBudgetGivesTheSameBitsAtAnyThreadCount) {
  const auto frames = [&](int threads) {
    const auto renderer =
        makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, share(0.15), threads));
    renderer->start(sequence_.start);
    std::vector<Image> images;
    for (const ChangedVoxels& changes : sequence_.changes) images.push_back(renderer->update(changes));
    return images;
  };
  const std::vector<Image> once = frames(1);
  for (const int threads : {1, 2, 4}) {
    const std::vector<Image> again = frames(threads);
    for (size_t i = 0; i < once.size(); ++i)
      ASSERT_TRUE(imagesEqualBitForBit(again[i], once[i])) << threads << " threads, frame " << i;
  }
}

TEST_F(Anytime, BeatsALowResolutionImageAtTheSameSamples) {
  for (const double ofFull : {0.1, 0.25}) {
    const double anytime = meanPsnr(sequence_, settings_, withBudget(Method::anytime, share(ofFull)), exact_);
    const double lowres = meanPsnr(sequence_, settings_, withBudget(Method::lowres, share(ofFull)), exact_);
    std::printf("%2.0f %% of the samples: anytime %.1f dB, lowres %.1f dB\n", 100 * ofFull, anytime, lowres);
    EXPECT_GT(anytime, lowres + 2);
  }
}

TEST_F(Anytime, BeatsLeavingTilesStaleByFar) {
  for (const double ofFull : {0.1, 0.25, 0.5}) {
    const double anytime = meanPsnr(sequence_, settings_, withBudget(Method::anytime, share(ofFull)), exact_);
    const double tiles = meanPsnr(sequence_, settings_, withBudget(Method::tiles, share(ofFull)), exact_);
    std::printf("%2.0f %% of the samples: anytime %.1f dB, tiles %.1f dB\n", 100 * ofFull, anytime, tiles);
    EXPECT_GT(anytime, tiles + 8);
  }
}

TEST_F(Anytime, TilesChosenByTheirEstimatedChangeBeatTheOldImage) {
  const double tiles = meanPsnr(sequence_, settings_, withBudget(Method::tiles, share(0.3)), exact_);
  double squared = 0;
  for (size_t i = 1; i < exact_.images.size(); ++i)
    squared += std::pow(colourError(exact_.images[i - 1], exact_.images[i]).rmse, 2);
  const double previous = -10 * std::log10(squared / double(exact_.images.size() - 1));
  std::printf("tiles at 30 %%: %.1f dB; the previous exact image: %.1f dB\n", tiles, previous);
  EXPECT_GT(tiles, previous - 6) << "though errors pile up over the steps";
}

TEST_F(Anytime, EveryBudgetedMethodIsExactWhenEverythingFits) {
  for (const Method method : {Method::anytime, Method::tiles, Method::lowres}) {
    const auto renderer = makeRenderer(sequence_.lattice, settings_, withBudget(method, share(4)));
    renderer->start(sequence_.start);
    for (size_t i = 0; i < 3; ++i)
      EXPECT_TRUE(imagesEqualBitForBit(renderer->update(sequence_.changes[i]), exact_.images[i]))
          << name(method);
  }
}

TEST_F(Anytime, MoreBudgetMeansLessError) {
  double before = 0;
  for (const double ofFull : {0.05, 0.1, 0.2, 0.4, 0.8}) {
    const double psnr = meanPsnr(sequence_, settings_, withBudget(Method::anytime, share(ofFull)), exact_);
    EXPECT_GT(psnr, before) << ofFull;
    before = psnr;
  }
}

TEST_F(Anytime, TheReportedIntervalHoldsTheTrueErrorInNineFramesOfTen) {
  int frames = 0, held = 0;
  for (const auto& tf : {softTransferFunction(kType), windowedTransferFunction(kType)}) {
    RenderSettings settings = jetSettings(tf);
    settings.width = settings.height = 384;
    const ExactFrames exact = exactFrames(sequence_, settings);
    for (const double ofFull : {0.1, 0.25, 0.5})
      for (uint64_t seed = 0; seed < 2; ++seed) {
        RendererOptions options =
            withBudget(Method::anytime, Budget::ofSamples(uint64_t(ofFull * exact.meanSamples())));
        options.seed = seed;
        const auto renderer = makeRenderer(sequence_.lattice, settings, options);
        renderer->start(sequence_.start);
        for (size_t i = 0; i < sequence_.changes.size(); ++i) {
          const double rmse = colourError(renderer->update(sequence_.changes[i]), exact.images[i]).rmse;
          const ErrorEstimate error = renderer->statistics().error.value();
          EXPECT_LE(error.low, error.rmse);
          held += error.low <= rmse && rmse <= error.high;
          ++frames;
        }
      }
  }
  std::printf("the interval held in %d of %d frames\n", held, frames);
  EXPECT_GE(held, 0.9 * frames);
}

TEST_F(Anytime, ABudgetTooSmallForTheCoarsestLatticeIsReported) {
  const auto renderer =
      makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, Budget::ofSamples(200)));
  renderer->start(sequence_.start);
  renderer->update(sequence_.changes[0]);
  EXPECT_TRUE(renderer->statistics().budgetTooSmall);
  EXPECT_LE(renderer->statistics().samples, 400u);
}

TEST_F(Anytime, SaysPixelByPixelWhereItIsExact) {
  const auto renderer = makeRenderer(sequence_.lattice, settings_, withBudget(Method::anytime, share(0.3)));
  renderer->start(sequence_.start);
  for (const float v : renderer->aov(FrameRenderer::Aov::error).data) EXPECT_EQ(v, 0);
  renderer->update(sequence_.changes[0]);
  const Image error = renderer->aov(FrameRenderer::Aov::error),
              level = renderer->aov(FrameRenderer::Aov::level), age = renderer->aov(FrameRenderer::Aov::age);
  EXPECT_GT(*std::max_element(error.data.begin(), error.data.end()), 0);
  EXPECT_THAT(level.data, testing::Each(testing::AnyOf(1.0f, 2.0f, 4.0f, 8.0f, 16.0f)));
  EXPECT_THAT(level.data, testing::Contains(1.0f));
  EXPECT_THAT(age.data, testing::Contains(0.0f));
  EXPECT_THAT(age.data, testing::Contains(1.0f));
}

TEST(AnytimePartly, WhereOnlyALittleChangesFramesAreExactOnABudgetThatIsAFractionOfAFullFrame) {
  const auto step = [](int i) { return movingBall(kType, 48, i); };
  const RenderSettings settings = settingsFor(step(0), "ortho", softTransferFunction(kType), 128, 128);
  ChangeDetector detector(step(0).field, 0);
  ThreadPool pool(1);
  RendererOptions options = withBudget(Method::full, {});
  const auto full = makeRenderer(step(0).lattice, settings, options);
  full->start(step(0).field);
  options = withBudget(Method::anytime, Budget::ofSamples(full->statistics().samples / 2));
  const auto renderer = makeRenderer(step(0).lattice, settings, options);
  renderer->start(step(0).field);
  for (int i = 1; i < 6; ++i) {
    const ChangedVoxels changes = detector.advance(step(i).field, pool);
    full->update(changes);
    EXPECT_TRUE(imagesEqualBitForBit(renderer->update(changes), full->image())) << "step " << i;
    EXPECT_LT(renderer->statistics().samples, full->statistics().samples / 2);
  }
}

TEST(AnytimePartly, WhatItCannotRenderExactlyItRefinesAndPaysLater) {
  const auto step = [](int i) { return movingBall(kType, 48, i); };
  const RenderSettings settings = settingsFor(step(0), "ortho", softTransferFunction(kType), 128, 128);
  ChangeDetector detector(step(0).field, 0);
  ThreadPool pool(1);
  const auto full = makeRenderer(step(0).lattice, settings, withBudget(Method::full, {}));
  full->start(step(0).field);
  const auto renderer =
      makeRenderer(step(0).lattice, settings,
                   withBudget(Method::anytime, Budget::ofSamples(full->statistics().samples / 20)));
  renderer->start(step(0).field);
  for (int i = 1; i < 6; ++i) {
    const ChangedVoxels changes = detector.advance(step(i).field, pool);
    full->update(changes);
    EXPECT_LT(colourError(renderer->update(changes), full->image()).rmse, 0.01) << "step " << i;
  }
  for (int i = 0; i < 40 && !imagesEqualBitForBit(renderer->image(), full->image()); ++i)
    renderer->update(noChanges(kType));
  EXPECT_TRUE(imagesEqualBitForBit(renderer->image(), full->image()));
}

// The first steps of the jet take few of the samples their segments hold, later ones many.
TEST(AnytimeFromASmallStart, NeverOverspendsOnAnExactFrameThatDoesNotFit) {
  const JetSequence sequence = jetSequence(2, 50);
  const RenderSettings settings = jetSettings(softTransferFunction(kType));
  const ExactFrames exact = exactFrames(sequence, settings);
  for (const double ofLast : {0.25, 0.5, 0.75}) {
    const auto budget = Budget::ofSamples(uint64_t(ofLast * double(exact.samples.back())));
    const auto renderer = makeRenderer(sequence.lattice, settings, withBudget(Method::anytime, budget));
    renderer->start(sequence.start);
    for (size_t i = 0; i < sequence.changes.size(); ++i) {
      renderer->update(sequence.changes[i]);
      EXPECT_LE(double(renderer->statistics().samples), 1.05 * double(budget.samples)) << ofLast << " " << i;
      EXPECT_FALSE(renderer->statistics().budgetTooSmall) << ofLast << " " << i;
      ASSERT_TRUE(renderer->statistics().error) << ofLast << " " << i;
    }
  }
}

TEST(AnytimeSettings, RefusesWhatCannotBeInterpolated) {
  const Scene scene = jet1(40);
  RenderSettings settings = jetSettings(softTransferFunction(kType));
  settings.mode = RenderMode::mip;
  for (const Method method : {Method::anytime, Method::lowres})
    EXPECT_THROW(makeRenderer(scene.lattice, settings, withBudget(method, Budget::time(10))), OptionError);
  settings.mode = RenderMode::dvr;
  settings.depth = true;
  EXPECT_THROW(makeRenderer(scene.lattice, settings, withBudget(Method::anytime, {})), OptionError);
}

}  // namespace
}  // namespace kairos::test
