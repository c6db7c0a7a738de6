// Equation 2 against the paper's table and against sampling itself.
#include "tcdvrm/selection_probability.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diff/influence_map.h"
#include "example_one.h"
#include "tcdvrm/pixel_selection.h"
#include "tcdvrm/voxel_sampler.h"

namespace kairos::test {
namespace {

TEST(SelectionProbability, MatchesTable1_D12) {
  constexpr double kTable1[10][4] = {{0.6211, 0.3106, 0.0621, 0.0062}, {0.8579, 0.5260, 0.1207, 0.0124},
                                     {0.9473, 0.6751, 0.1760, 0.0186}, {0.9806, 0.7779, 0.2282, 0.0248},
                                     {0.9930, 0.8486, 0.2773, 0.0311}, {0.9975, 0.8971, 0.3237, 0.0373},
                                     {0.9991, 0.9303, 0.3673, 0.0435}, {0.9997, 0.9529, 0.4084, 0.0497},
                                     {0.9999, 0.9683, 0.4471, 0.0559}, {0.9999, 0.9787, 0.4834, 0.0621}};
  for (uint64_t sv = 1; sv <= 10; ++sv)
    for (size_t r = 0; r < 4; ++r)
      EXPECT_NEAR(selectionProbability(161, uint64_t(kExampleInfluence[r]), sv), kTable1[sv - 1][r], 1e-4)
          << "SV = " << sv << ", I = " << kExampleInfluence[r];
}

TEST(SelectionProbability, IsOneWhereTheSamplesCannotAllMiss_D11) {
  EXPECT_EQ(selectionProbability(161, 100, 62), 1);
  EXPECT_EQ(selectionProbability(10, 3, 8), 1);
  EXPECT_DOUBLE_EQ(selectionProbability(10, 3, 7), 1 - 1.0 / 120);
  EXPECT_EQ(selectionProbability(161, 161, 1), 1);
  EXPECT_EQ(selectionProbability(161, 1, 161), 1);
  EXPECT_EQ(selectionProbability(161, 0, 50), 0);
  EXPECT_EQ(selectionProbability(161, 50, 0), 0);
}

TEST(SelectionProbability, IsSymmetricAndExactForMillionsOfVoxels) {
  EXPECT_DOUBLE_EQ(selectionProbability(5'000'000, 1, 500'000), 0.1);
  EXPECT_DOUBLE_EQ(selectionProbability(5'000'000, 700, 4000), selectionProbability(5'000'000, 4000, 700));
  // Two of n voxels, k drawn: 1 - (n - k)(n - k - 1) / (n (n - 1)).
  const double n = 1e6, k = 159'000;
  EXPECT_NEAR(selectionProbability(1'000'000, 2, 159'000), 1 - (n - k) * (n - k - 1) / (n * (n - 1)), 1e-13);
}

TEST(SelectionProbability, PrefersTheLargerInfluenceAtEverySampleCount_D13) {
  for (uint64_t sv = 1; sv <= 61; ++sv)
    for (size_t r = 1; r < 4; ++r)
      EXPECT_GT(selectionProbability(161, uint64_t(kExampleInfluence[r - 1]), sv),
                selectionProbability(161, uint64_t(kExampleInfluence[r]), sv))
          << sv;
}

/// How often each pixel is determined by `sampled` of the changed voxels, over `runs` runs.
std::vector<int> timesDetermined(const VoxelProjection& projection, const ChangedVoxels& changes,
                                 uint64_t sampled, int runs) {
  PixelSelection selection(projection, 1);
  UniformSampler sampler;
  std::vector<int> times(selection.counts().size());
  for (int run = 0; run < runs; ++run) {
    selection.clear();
    sampler.restart(changes.count(), uint64_t(run) * 1000 + sampled);
    for (uint64_t i = 0; i < sampled; ++i)
      selection.add(changes.locate(sampler.next()), [](uint32_t) { return 1u; });
    for (const uint32_t pixel : selection.units()) ++times[pixel];
  }
  return times;
}

double standardDeviation(double probability, int runs) {
  return std::sqrt(std::max(probability * (1 - probability), 1e-6) / runs);
}

TEST(SelectionProbability, IsHowOftenSamplingDeterminesThePixelsOfExample1_D11) {
  constexpr int kRuns = 20'000;
  const ChangedVoxels changes = exampleChanges();
  ASSERT_EQ(changes.count(), 161u);
  for (uint64_t sv = 1; sv <= 10; ++sv) {
    const std::vector<int> times = timesDetermined(exampleProjection(), changes, sv, kRuns);
    for (int r = 0; r < 4; ++r) {
      const double expected = selectionProbability(161, uint64_t(kExampleInfluence[size_t(r)]), sv);
      EXPECT_NEAR(double(times[examplePixel(r)]) / kRuns, expected, 3 * standardDeviation(expected, kRuns))
          << "SV = " << sv << ", I = " << kExampleInfluence[size_t(r)];
    }
  }
}

// Overlapping interpolation spaces, influence numbers from one up: the equation holds pixel by pixel.
TEST(SelectionProbability, IsHowOftenSamplingDeterminesThePixelsOfAView_D11) {
  constexpr int kRuns = 3000;
  std::mt19937 random(17);
  const Scene scene = plume(ElementType::u8, 32);
  const ChangedVoxels changes =
      changesOf(ElementType::u8, randomVoxels(ElementType::u8, scene.lattice.domain, 300, 0, random));
  RenderSettings settings;
  settings.camera = cameraNamed("iso", scene.lattice);
  settings.width = settings.height = 40;
  const VoxelProjection projection(settings, scene.lattice,
                                   {ProjectionOrder::trilinear, ProjectionMode::paper});
  ThreadPool pool(1);
  InfluenceMap influence(projection, pool);
  influence.add(changes.leaves);
  influence.refresh();
  const std::vector<int> times = timesDetermined(projection, changes, 60, kRuns);
  int changed = 0, beyond = 0;
  for (size_t pixel = 0; pixel < times.size(); ++pixel) {
    const auto number = uint64_t(influence.numbers()[pixel]);
    if (number == 0) {
      ASSERT_EQ(times[pixel], 0);
      continue;
    }
    ++changed;
    const double expected = selectionProbability(changes.count(), number, 60);
    beyond += std::abs(double(times[pixel]) / kRuns - expected) > 3 * standardDeviation(expected, kRuns);
  }
  EXPECT_GT(changed, 300);
  EXPECT_LE(beyond, changed / 100) << "3 sigma leave 0.27 % outside";
}

}  // namespace
}  // namespace kairos::test
