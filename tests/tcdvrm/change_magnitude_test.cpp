// By how much voxels change, and voxels that wait for several steps.
#include "tcdvrm/change_magnitude.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "diff/sequences.h"
#include "tcdvrm/voxel_pool.h"

namespace kairos::test {
namespace {

double rendered(double value, double background) {
  return std::isfinite(value) ? value : background;
}

TEST(ChangeMagnitudes, AreTheDifferencesOfOldAndNewValues_D9) {
  ThreadPool pool(2);
  for (const Sequence& sequence : allSequences()) {
    BrickVolume volume(sequence.lattice, sequence.steps.front(), pool);
    const std::vector<ChangedVoxels> changes = sequence.changes();
    for (size_t step = 0; step < changes.size(); ++step) {
      const std::vector<float> magnitudes = changeMagnitudes(volume, changes[step], pool);
      ASSERT_EQ(magnitudes.size(), changes[step].count());
      const Field &before = sequence.steps[step], &after = sequence.steps[step + 1];
      for (uint64_t i = 0; i < changes[step].count(); i += 7) {
        const Vec3i v = changes[step].locate(i);
        const double old = rendered(before.value(v), before.background);
        ASSERT_EQ(magnitudes[i], float(std::abs(rendered(after.value(v), after.background) - old)))
            << sequence.name << ' ' << step << ' ' << i;
      }
      volume.apply(changes[step], pool);
    }
  }
}

TEST(ChangeMagnitudes, BecomeWeightsInProportion_D9) {
  EXPECT_EQ(samplingWeights({0, 1, 2, 4}), (std::vector<uint16_t>{1, 16384, 32768, 65535}));
  EXPECT_EQ(samplingWeights({0, 0}), (std::vector<uint16_t>{1, 1}));
  EXPECT_TRUE(samplingWeights({}).empty());
  EXPECT_EQ(samplingWeights({1e-30f, std::numeric_limits<float>::max()}), (std::vector<uint16_t>{1, 65535}));
}

VoxelMap voxelsOf(const ChangedVoxels& set) {
  VoxelMap voxels;
  for (uint64_t i = 0; i < set.count(); ++i) voxels[set.locate(i)] = valuesAs<float>(set.values)[i];
  return voxels;
}

TEST(VoxelPool, UnitesWhatWaitsWithWhatChanges) {
  std::mt19937 random(2);
  const VoxelBox box{{-9, 0, 3}, {20, 17, 30}};
  ChangedVoxels waiting = changesOf(ElementType::f32, {});
  VoxelMap expected;
  for (int step = 0; step < 5; ++step) {
    const ChangedVoxels changes =
        changesOf(ElementType::f32, randomVoxels(ElementType::f32, box, step == 2 ? 0 : 300, 0, random));
    for (const auto& [v, magnitude] : voxelsOf(changes)) expected[v] = float(expected[v]) + float(magnitude);
    waiting = unitedVoxels(waiting, changes.leaves, valuesAs<float>(changes.values));
    EXPECT_EQ(voxelsOf(waiting), expected);
    const auto stays = [](const Vec3i& v) { return (v.x + v.y + v.z) % 3 != 0; };
    std::erase_if(expected, [&](const auto& entry) { return !stays(entry.first); });
    waiting = keptVoxels(waiting, stays);
    EXPECT_EQ(voxelsOf(waiting), expected);
  }
  EXPECT_FALSE(waiting.empty());
  waiting = keptVoxels(waiting, [](const Vec3i&) { return false; });
  EXPECT_TRUE(waiting.empty());
  EXPECT_EQ(waiting.count(), 0u);
}

}  // namespace
}  // namespace kairos::test
