// TCDVRM: budgets, what they leave out, and time that a test controls.
#include "tcdvrm/tcdvrm_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diff/dvrm_renderer.h"
#include "diff/influence_map.h"
#include "diff/sequences.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos::test {
namespace {

RendererOptions tcdvrm(Budget budget, int threads = 1) {
  RendererOptions o = withMethod(Method::tcdvrm, threads);
  o.budget = budget;
  o.seed = 7;
  return o;
}

RenderSettings settingsOf(const Sequence& sequence, const std::string& camera = "iso", int edge = 64) {
  return settingsFor(sequence.scene(), camera, softTransferFunction(sequence.lattice.type), edge, edge);
}

/// Each step's image.
std::vector<Image> imagesOf(FrameRenderer& renderer, const Sequence& sequence) {
  std::vector<Image> images{renderer.start(sequence.steps[0])};
  for (const ChangedVoxels& changes : sequence.changes()) images.push_back(renderer.update(changes));
  return images;
}

TEST(Tcdvrm, WithoutALimitEqualsDvrmBitForBit_D17) {
  for (const Sequence& sequence : {ballSequence(ElementType::u8), scatterSequence(ElementType::f32)})
    for (const ProjectionMode mode : {ProjectionMode::paper, ProjectionMode::conservative})
      for (const ProjectionOrder order : {ProjectionOrder::zero, ProjectionOrder::trilinear})
        for (const Budget budget : {Budget{}, Budget::ofSamples(uint64_t(1) << 60), Budget::time(1e9)}) {
          RendererOptions budgeted = tcdvrm(budget, 2), exact = withMethod(Method::dvrm);
          budgeted.projection = exact.projection = {order, mode};
          TcdvrmRenderer renderer(sequence.lattice, settingsOf(sequence), budgeted);
          DvrmRenderer dvrm(sequence.lattice, settingsOf(sequence), exact);
          renderer.start(sequence.steps[0]);
          dvrm.start(sequence.steps[0]);
          for (const ChangedVoxels& changes : sequence.changes()) {
            renderer.update(changes);
            dvrm.update(changes);
            ASSERT_TRUE(imagesEqualBitForBit(renderer.image(), dvrm.image())) << sequence.name;
            EXPECT_EQ(renderer.statistics().voxelsSampled, changes.count());
            EXPECT_TRUE(std::ranges::equal(renderer.sampledInfluence(), dvrm.influence()));
            EXPECT_EQ(renderer.statistics().stalePixels, 0u);
          }
        }
}

TEST(Tcdvrm, StopsSamplingWhenTheRaysUseUpTheBudget_D14) {
  const Sequence sequence = noiseSequence(ElementType::u8);
  constexpr uint64_t kSamples = 20'000;
  TcdvrmRenderer renderer(sequence.lattice, settingsOf(sequence), tcdvrm(Budget::ofSamples(kSamples)));
  renderer.start(sequence.steps[0]);
  const uint64_t all = renderer.statistics().rayPoints;
  ASSERT_GT(all, 3 * kSamples);
  for (const ChangedVoxels& changes : sequence.changes()) {
    renderer.update(changes);
    const FrameStatistics& s = renderer.statistics();
    EXPECT_GE(s.rayPoints, kSamples);
    EXPECT_LT(s.rayPoints, kSamples + all / 20) << "the last sample adds no more than one voxel's packets";
    EXPECT_LE(s.samples, s.rayPoints);
    EXPECT_GT(s.voxelsSampled, 0u);
    EXPECT_LT(s.voxelsSampled, changes.count());
    EXPECT_GT(s.stalePixels, 0u);
    EXPECT_FALSE(s.error.has_value());
  }
}

TEST(Tcdvrm, ABudgetOfSamplesGivesTheSameBitsAtAnyThreadCount_D10) {
  const Sequence sequence = scatterSequence(ElementType::f32);
  for (const bool carryOver : {false, true})
    for (const LevelOfModification lom : {LevelOfModification::influence, LevelOfModification::magnitude}) {
      std::vector<std::vector<Image>> runs;
      for (const int threads : {1, 2, 5}) {
        RendererOptions o = tcdvrm(Budget::ofSamples(15'000), threads);
        o.tcdvrm.carryOver = carryOver;
        o.tcdvrm.lom = lom;
        TcdvrmRenderer renderer(sequence.lattice, settingsOf(sequence), o);
        runs.push_back(imagesOf(renderer, sequence));
      }
      RendererOptions other = tcdvrm(Budget::ofSamples(15'000));
      other.seed = 8;
      TcdvrmRenderer otherRenderer(sequence.lattice, settingsOf(sequence), other);
      const std::vector<Image> otherImages = imagesOf(otherRenderer, sequence);
      for (size_t step = 0; step < runs[0].size(); ++step) {
        ASSERT_TRUE(imagesEqualBitForBit(runs[0][step], runs[1][step])) << step;
        ASSERT_TRUE(imagesEqualBitForBit(runs[0][step], runs[2][step])) << step;
        if (step > 0) {
          EXPECT_FALSE(imagesEqualBitForBit(runs[0][step], otherImages[step])) << step;
        }
      }
    }
}

TEST(Tcdvrm, PixelsThatNoSampleInfluencesStayAsTheyWere_D10) {
  const Sequence sequence = noiseSequence(ElementType::u8);
  const RenderSettings settings = settingsOf(sequence);
  for (const ProjectionMode mode : {ProjectionMode::paper, ProjectionMode::conservative}) {
    RendererOptions o = tcdvrm(Budget::ofSamples(15'000));
    o.projection.mode = mode;
    TcdvrmRenderer renderer(sequence.lattice, settings, o);
    const auto full = makeRenderer(sequence.lattice, settings, withMethod(Method::full));
    Image before = renderer.start(sequence.steps[0]);
    full->start(sequence.steps[0]);
    for (const ChangedVoxels& changes : sequence.changes()) {
      renderer.update(changes);
      full->update(changes);
      const auto d = renderer.sampledInfluence();
      uint64_t written = 0;
      for (int y = 0; y < settings.height; ++y)
        for (int x = 0; x < settings.width; ++x) {
          bool cast = d[size_t(y * settings.width + x)] > 0;
          if (mode == ProjectionMode::conservative)  // all pixels of the packet
            for (int i = 0; i < 16; ++i)
              cast = cast || d[size_t((y / 4 * 4 + i / 4) * settings.width + x / 4 * 4 + i % 4)] > 0;
          const float* expected = cast ? full->image().pixel(x, y) : before.pixel(x, y);
          ASSERT_TRUE(std::equal(expected, expected + 4, renderer.image().pixel(x, y))) << x << ' ' << y;
          written += cast;
        }
      EXPECT_EQ(renderer.statistics().pixelsRecast, written);
      before = renderer.image();
    }
  }
}

// The pixels with the largest influence numbers are found first.
TEST(Tcdvrm, FindsMostOfTheMostInfluencedPixels_D20) {
  const Sequence sequence = scatterSequence(ElementType::u8);
  RendererOptions o = tcdvrm(Budget::ofSamples(30'000));
  o.projection = {ProjectionOrder::trilinear, ProjectionMode::paper};
  TcdvrmRenderer renderer(sequence.lattice, settingsOf(sequence), o);
  RendererOptions exact = withMethod(Method::dvrm);
  exact.projection = o.projection;
  DvrmRenderer dvrm(sequence.lattice, settingsOf(sequence), exact);
  renderer.start(sequence.steps[0]);
  dvrm.start(sequence.steps[0]);
  const ChangedVoxels changes = sequence.changes()[0];
  renderer.update(changes);
  dvrm.update(changes);
  const auto all = influenceHistogram(dvrm.influence());
  const size_t median = [&] {
    uint64_t changed = dvrm.statistics().pixelsInfluenced, below = 0;
    size_t n = 1;
    while ((below += all[n]) < changed / 2) ++n;
    return n;
  }();
  double found[2] = {}, of[2] = {};
  for (size_t i = 0; i < dvrm.influence().size(); ++i) {
    const auto n = size_t(dvrm.influence()[i]);
    if (n == 0) continue;
    of[n > median] += 1;
    found[n > median] += renderer.sampledInfluence()[i] > 0;
  }
  EXPECT_GT(found[1] / of[1], found[0] / of[0]);
  EXPECT_LT(found[1], of[1]);
}

// Values of the left half change by one, those of the right half by a hundred.
TEST(Tcdvrm, PrefersStronglyChangedVoxelsByMagnitude_D9) {
  const Lattice lattice = denseLattice(ElementType::u8, {32, 32, 32});
  VoxelMap after = filled({{0, 0, 0}, {16, 32, 32}}, 101);
  after.merge(filled({{16, 0, 0}, {32, 32, 32}}, 200));
  const Sequence sequence{
      "halves", lattice, {fieldOf(lattice, filled(lattice.domain, 100)), fieldOf(lattice, after)}};
  const RenderSettings settings = settingsOf(sequence, "-y");  // x to the right
  double share[2];
  for (const LevelOfModification lom : {LevelOfModification::influence, LevelOfModification::magnitude}) {
    RendererOptions o = tcdvrm(Budget::ofSamples(20'000));
    o.tcdvrm.lom = lom;
    TcdvrmRenderer renderer(lattice, settings, o);
    renderer.start(sequence.steps[0]);
    renderer.update(sequence.changes()[0]);
    int left = 0, right = 0;
    const auto d = renderer.sampledInfluence();
    for (size_t i = 0; i < d.size(); ++i)
      (int(i) % settings.width < settings.width / 2 ? left : right) += d[i] > 0;
    share[int(lom)] = double(right) / (left + right);
  }
  EXPECT_NEAR(share[int(LevelOfModification::influence)], 0.5, 0.15);
  EXPECT_GT(share[int(LevelOfModification::magnitude)], 0.85);
}

TEST(Tcdvrm, CarryOverCatchesUpOnceChangesStop_D10) {
  Sequence sequence = noiseSequence(ElementType::u8);
  for (int i = 0; i < 12; ++i) sequence.steps.push_back(sequence.steps.back());
  const RenderSettings settings = settingsOf(sequence);
  for (const bool carryOver : {false, true}) {
    RendererOptions o = tcdvrm(Budget::ofSamples(60'000));
    o.tcdvrm.carryOver = carryOver;
    TcdvrmRenderer renderer(sequence.lattice, settings, o);
    const auto full = makeRenderer(sequence.lattice, settings, withMethod(Method::full));
    const bool caughtUp =
        bool(imagesEqualBitForBit(imagesOf(renderer, sequence).back(), imagesOf(*full, sequence).back()));
    EXPECT_EQ(caughtUp, carryOver);
    EXPECT_EQ(renderer.statistics().error.has_value(), carryOver);
  }
}

TEST(Tcdvrm, RayPointsAreTheSamplesAlongEachRay_D16) {
  const Scene scene = constantScene(ElementType::u8, {40, 33, 37}, 0.5);
  for (const std::string& camera : cameraNames()) {
    RenderSettings settings = settingsFor(scene, camera, softTransferFunction(ElementType::u8), 45, 38);
    settings.mode = RenderMode::average;  // no ray ends early
    TcdvrmRenderer renderer(scene.lattice, settings, tcdvrm({}));
    renderer.start(scene.field);
    const Image points = renderer.aov(FrameRenderer::Aov::samples);
    ASSERT_EQ(points.width, 45);
    ASSERT_EQ(points.channels, 1);
    EXPECT_EQ(std::accumulate(points.data.begin(), points.data.end(), 0.0),
              double(renderer.statistics().samples))
        << camera;
    EXPECT_GE(double(renderer.statistics().rayPoints), double(renderer.statistics().samples));
    const auto [least, most] = std::minmax_element(points.data.begin(), points.data.end());
    EXPECT_LT(*least, *most) << "the number depends on the ray";
  }
}

/// Time passes with the work alone, `cost` milliseconds a sample.
class VirtualClock : public BudgetClock {
 public:
  double now() override { return time_; }
  void worked(uint64_t samples, uint64_t /*segments*/) override { time_ += double(samples) * cost; }
  double cost = 1e-4;

 private:
  double time_ = 0;
};

TEST(Tcdvrm, FollowsAMachineThatBecomesTwiceAsSlow_D15) {
  // Everything changes at every step, so that every step has to leave something out.
  Sequence sequence{"noise", denseNoise(ElementType::u8, 36).lattice, {}};
  for (uint32_t step = 0; step < 16; ++step)
    sequence.steps.push_back(denseNoise(ElementType::u8, 36, step + 1).field);
  const std::vector<ChangedVoxels> changes = sequence.changes();
  const RenderSettings settings = settingsOf(sequence, "iso", 192);
  for (const bool calibrate : {true, false}) {
    VirtualClock clock;
    RendererOptions o = tcdvrm({});
    o.clock = &clock;
    o.tcdvrm.calibrate = calibrate;
    TcdvrmRenderer unlimited(sequence.lattice, settings, o);
    unlimited.start(sequence.steps[0]);
    const double fullMs = clock.now();
    const double budget = fullMs / 2;
    o.budget = Budget::time(budget);
    TcdvrmRenderer renderer(sequence.lattice, settings, o);
    renderer.start(sequence.steps[0]);
    for (size_t step = 0; step < changes.size(); ++step) {
      if (step == 6) clock.cost *= 2;
      const double begin = clock.now();
      renderer.update(changes[step]);
      const double took = clock.now() - begin;
      ASSERT_TRUE(renderer.statistics().predictedMs.has_value());
      const bool recovered = step < 6 ? step >= 2 : step >= 6 + 3;
      if (calibrate && recovered) {
        EXPECT_NEAR(took, budget, 0.12 * budget) << step;
      }
      if (calibrate && step == 6) {
        EXPECT_GT(took, 1.6 * budget) << "the slowdown was felt";
      }
      if (!calibrate && step > 6) {
        EXPECT_GT(took, 1.6 * budget) << "nothing was learnt";
      }
    }
  }
}

TEST(Tcdvrm, CutsCastingOffAtTheEndOfTheTime_D14) {
  const Sequence sequence = noiseSequence(ElementType::u8);
  VirtualClock clock;
  RendererOptions o = tcdvrm(Budget::time(1));
  o.clock = &clock;
  o.tcdvrm.cutOff = true;
  RenderSettings settings = settingsOf(sequence, "iso", 160);
  TcdvrmRenderer renderer(sequence.lattice, settings, o);
  clock.cost = 1e-7;
  renderer.start(sequence.steps[0]);  // teaches a far too low cost
  clock.cost = 1e-5;
  const double begin = clock.now();
  renderer.update(sequence.changes()[0]);
  const double took = clock.now() - begin;
  const FrameStatistics& s = renderer.statistics();
  EXPECT_GT(s.stalePixels, 0u);
  EXPECT_GE(took, 1);
  EXPECT_LT(took, 1 + 256 * 16 * 64 * clock.cost) << "one batch late at most";
}

}  // namespace
}  // namespace kairos::test
