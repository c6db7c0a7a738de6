// Sampling without replacement.
#include "tcdvrm/voxel_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kairos::test {
namespace {

template <class Sampler>
std::vector<uint64_t> drawAll(Sampler& sampler) {
  std::vector<uint64_t> drawn;
  while (sampler.remaining()) drawn.push_back(sampler.next());
  return drawn;
}

void expectEachOnce(std::vector<uint64_t> drawn, size_t count) {
  std::sort(drawn.begin(), drawn.end());
  std::vector<uint64_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(drawn, all);
}

TEST(UniformSampler, DrawsEachNumberOnceAndTheSameForTheSameSeed_D10) {
  UniformSampler sampler;
  for (const uint64_t count : {1, 2, 1000, 7, 12345}) {
    sampler.restart(count, 5);
    const std::vector<uint64_t> first = drawAll(sampler);
    expectEachOnce(first, count);
    sampler.restart(count, 5);
    EXPECT_EQ(drawAll(sampler), first);
    if (count < 100) continue;
    sampler.restart(count, 6);
    EXPECT_NE(drawAll(sampler), first);
  }
  sampler.restart(0, 1);
  EXPECT_EQ(sampler.remaining(), 0u);
}

TEST(UniformSampler, ForgetsWhatWasDrawnOnlyInPart_D10) {
  UniformSampler used, fresh;
  used.restart(500, 1);
  for (int i = 0; i < 40; ++i) used.next();
  used.restart(300, 9);
  fresh.restart(300, 9);
  EXPECT_EQ(drawAll(used), drawAll(fresh));
}

// Every ordered pair of the first two draws of five is equally likely: chi-squared with 19 degrees of
// freedom.
TEST(UniformSampler, DrawsEveryOrderEquallyOften_D10) {
  constexpr int kRuns = 40'000, kPairs = 20;
  UniformSampler sampler;
  std::vector<int> times(25);
  for (int run = 0; run < kRuns; ++run) {
    sampler.restart(5, uint64_t(run));
    const uint64_t first = sampler.next(), second = sampler.next();
    ++times[first * 5 + second];
  }
  double chiSquared = 0;
  for (size_t i = 0; i < 25; ++i) {
    if (i / 5 == i % 5) {
      EXPECT_EQ(times[i], 0);
      continue;
    }
    const double expected = double(kRuns) / kPairs;
    chiSquared += (times[i] - expected) * (times[i] - expected) / expected;
  }
  EXPECT_LT(chiSquared, 43.8);  // 0.1 % of truly uniform samplers exceed it
}

TEST(WeightedSampler, DrawsEachItemOnceAndTheSameForTheSameSeed_D9) {
  std::vector<uint16_t> weights;
  for (int i = 0; i < 3000; ++i) weights.push_back(uint16_t(i % 7 == 0 ? 60000 : i % 5));
  WeightedSampler sampler;
  sampler.restart(weights, 3);
  const std::vector<uint64_t> first = drawAll(sampler);
  expectEachOnce(first, weights.size());
  sampler.restart(weights, 3);
  EXPECT_EQ(drawAll(sampler), first);
  sampler.restart({}, 3);
  EXPECT_EQ(sampler.remaining(), 0u);
}

// P(first = i) = w_i / sum, P(second = j | first = i) = w_j / (sum - w_i), also past a compaction.
TEST(WeightedSampler, DrawsInProportionToTheWeightsLeft_D9) {
  constexpr int kRuns = 60'000;
  const std::vector<uint16_t> weights{60, 25, 10, 5};
  WeightedSampler sampler;
  std::vector<int> times(16);
  for (int run = 0; run < kRuns; ++run) {
    sampler.restart(weights, uint64_t(run) + 77);
    const uint64_t first = sampler.next(), second = sampler.next();
    ++times[first * 4 + second];
  }
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = 0; j < 4; ++j) {
      const double expected = i == j ? 0 : weights[i] / 100.0 * weights[j] / (100.0 - weights[i]);
      EXPECT_NEAR(double(times[i * 4 + j]) / kRuns, expected, 4 * std::sqrt(expected / kRuns))
          << i << ' ' << j;
    }
}

}  // namespace
}  // namespace kairos::test
