// Influence numbers against counting, and the second-order difference against set arithmetic.
#include "diff/influence_map.h"

#include <gtest/gtest.h>

#include <bit>
#include <numeric>
#include <set>

#include "diff/second_order_difference.h"
#include "sequences.h"

namespace kairos::test {
namespace {

constexpr ProjectionRules kAllRules[] = {{ProjectionOrder::zero, ProjectionMode::paper},
                                         {ProjectionOrder::trilinear, ProjectionMode::paper},
                                         {ProjectionOrder::zero, ProjectionMode::conservative},
                                         {ProjectionOrder::trilinear, ProjectionMode::conservative}};

RenderSettings viewOf(const Lattice& lattice, const std::string& camera) {
  RenderSettings settings;
  settings.camera = cameraNamed(camera, lattice);
  settings.width = 70;
  settings.height = 66;
  return settings;
}

std::vector<int32_t> influenceByCounting(const VoxelProjection& projection, const ChangedVoxels& changes) {
  std::vector<int32_t> numbers(size_t(projection.width()) * size_t(projection.height()));
  PixelRows j(projection.height());
  for (uint64_t i = 0; i < changes.count(); ++i) {
    projection.project(changes.locate(i), j);
    for (int y = j.top; y <= j.bottom; ++y)
      for (int x = j.first[size_t(y)]; x <= j.last[size_t(y)]; ++x)
        ++numbers[size_t(y) * size_t(projection.width()) + size_t(x)];
  }
  return numbers;
}

std::vector<int32_t> influenceNumbers(const VoxelProjection& projection, const ChangedVoxels& changes,
                                      int threads) {
  ThreadPool pool(threads);
  InfluenceMap map(projection, pool);
  map.add(changes.leaves);
  map.refresh();
  return {map.numbers().begin(), map.numbers().end()};
}

TEST(InfluenceNumbers, EqualThoseCountedPixelByPixel_D6) {
  for (const Sequence& sequence : {flickerSequence(ElementType::u8), ballSequence(ElementType::f32)}) {
    const ChangedVoxels changes = sequence.changes().front();
    for (const std::string& camera : cameraNames())
      for (const ProjectionRules& rules : kAllRules) {
        const VoxelProjection projection(viewOf(sequence.lattice, camera), sequence.lattice, rules);
        const std::vector<int32_t> expected = influenceByCounting(projection, changes);
        for (const int threads : {1, 2, 5})
          ASSERT_EQ(influenceNumbers(projection, changes, threads), expected)
              << sequence.name << ' ' << camera << ' ' << int(rules.order) << int(rules.mode) << ' '
              << threads;
      }
  }
}

// Definition 2 without any projection: follow every pixel's ray and count the interpolation spaces it meets.
TEST(InfluenceNumbers, EqualTheInterpolationSpacesEachRayPasses_D6) {
  const Sequence sequence = flickerSequence(ElementType::u8);
  const ChangedVoxels changes = sequence.changes()[3];
  const RenderSettings settings = viewOf(sequence.lattice, "iso");
  const VoxelProjection projection(settings, sequence.lattice,
                                   {ProjectionOrder::trilinear, ProjectionMode::paper});
  const std::vector<int32_t> numbers = influenceNumbers(projection, changes, 1);
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  int changed = 0;
  for (int y = 0; y < settings.height; ++y)
    for (int x = 0; x < settings.width; ++x) {
      const Ray ray = generator.ray(x + 0.5, y + 0.5);  // the lattice's index space is world space
      int32_t count = 0;
      for (uint64_t i = 0; i < changes.count(); ++i) {
        const Vec3d v(changes.locate(i));
        double enter = 0, leave = 1e9;
        for (int a = 0; a < 3; ++a) {
          const double in = (v[a] - 1 - ray.origin[a]) / ray.direction[a];
          const double out = (v[a] + 1 - ray.origin[a]) / ray.direction[a];
          enter = std::max(enter, std::min(in, out));
          leave = std::min(leave, std::max(in, out));
        }
        count += enter <= leave;
      }
      ASSERT_EQ(numbers[size_t(y) * size_t(settings.width) + size_t(x)], count) << x << ' ' << y;
      changed += count > 0;
    }
  EXPECT_GT(changed, 0);
}

TEST(InfluenceNumbers, HistogramCountsPixelsByNumber_D20) {
  const int32_t numbers[] = {0, 3, 1, 0, 3, 0, 7};
  EXPECT_EQ(influenceHistogram(numbers), (std::vector<uint64_t>{3, 1, 0, 2, 0, 0, 0, 1}));
  EXPECT_EQ(influenceHistogram({}), std::vector<uint64_t>{0});
}

using Positions = std::set<Vec3i, LessZYX>;

Positions positionsOf(const std::vector<ChangedLeaf>& leaves) {
  Positions positions;
  for (const ChangedLeaf& leaf : leaves)
    for (int i = 0; i < kLeafVoxels; ++i)
      if (leaf.mask[size_t(i / 64)] >> (i % 64) & 1)
        positions.insert(leaf.origin + Vec3i{i & 7, i >> 3 & 7, i >> 6});
  return positions;
}

Positions without(const Positions& a, const Positions& b) {
  Positions rest;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::inserter(rest, rest.end()), LessZYX{});
  return rest;
}

TEST(SecondOrderDifference, HoldsThePositionsInExactlyOneOfTwoConsecutiveSets_D7) {
  for (const Sequence& sequence : allSequences()) {
    std::vector<ChangedLeaf> before;
    for (const ChangedVoxels& changes : sequence.changes()) {
      const SecondOrderDifference sod = secondOrderDifference(before, changes.leaves);
      const Positions was = positionsOf(before), is = positionsOf(changes.leaves);
      EXPECT_EQ(positionsOf(sod.added), without(is, was)) << sequence.name;
      EXPECT_EQ(positionsOf(sod.removed), without(was, is)) << sequence.name;
      EXPECT_EQ(sod.count(), positionsOf(sod.added).size() + positionsOf(sod.removed).size());
      before = changes.leaves;
    }
  }
}

TEST(SecondOrderDifference, MaintainsTheInfluenceNumbersExactly_D7) {
  ThreadPool pool(2);
  for (const Sequence& sequence : {ballSequence(ElementType::u8), flickerSequence(ElementType::u8),
                                   blockSequence(ElementType::u16), pulseSequence(ElementType::u8)})
    for (const ProjectionRules& rules : kAllRules) {
      const VoxelProjection projection(viewOf(sequence.lattice, "close"), sequence.lattice, rules);
      InfluenceMap map(projection, pool);
      std::vector<ChangedLeaf> before;
      for (const ChangedVoxels& changes : sequence.changes()) {
        const SecondOrderDifference sod = secondOrderDifference(before, changes.leaves);
        map.remove(sod.removed);
        map.add(sod.added);
        map.refresh();
        ASSERT_TRUE(std::ranges::equal(map.numbers(), influenceNumbers(projection, changes, 1)))
            << sequence.name << ' ' << int(rules.order) << int(rules.mode);
        before = changes.leaves;
      }
    }
}

TEST(SecondOrderDifference, IsEmptyWhereTheSameVoxelsChangeAgain_D7) {
  const Sequence sequence = noiseSequence(ElementType::u8);
  const std::vector<ChangedVoxels> changes = sequence.changes();
  EXPECT_LT(secondOrderDifference(changes[0].leaves, changes[1].leaves).count(), changes[1].count() / 50);
  EXPECT_EQ(secondOrderDifference(changes[1].leaves, changes[1].leaves).count(), 0u);
}

}  // namespace
}  // namespace kairos::test
