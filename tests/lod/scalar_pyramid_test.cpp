#include "lod/scalar_pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "lod/differences.h"
#include "support/scenes.h"

namespace kairos {
namespace {

ThreadPool pool(2);

Lattice cubeLattice(int edge) {
  return test::denseLattice(ElementType::f32, {edge, edge, edge});
}

// The mean over cells, a cell being the mean of its 8 vertices: vertices on the outside count half.
double cellMean(const ScalarPyramid& pyramid, int level) {
  const Vec3i n = pyramid.vertices(level);
  double sum = 0, weights = 0;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        const double weight = (x == 0 || x == n.x - 1 ? 0.5 : 1) * (y == 0 || y == n.y - 1 ? 0.5 : 1) *
                              (z == 0 || z == n.z - 1 ? 0.5 : 1);
        sum += weight * double(pyramid.value(level, {x, y, z}));
        weights += weight;
      }
  return sum / weights;
}

Field noise(const Lattice& lattice, uint32_t seed = 3) {
  return test::sampledField(lattice, [seed](const Vec3i& v) { return test::whiteNoise(v, seed); });
}

TEST(ScalarPyramid, EveryLevelKeepsTheMean_L3) {
  const Lattice lattice = cubeLattice(33);
  const ScalarPyramid pyramid(lattice, noise(lattice), pyramidLevels(32, 2), pool);
  ASSERT_EQ(pyramid.levels(), 5);
  for (int l = 0; l < pyramid.levels(); ++l) {
    EXPECT_EQ(pyramid.vertices(l).x, (32 >> l) + 1);
    EXPECT_NEAR(cellMean(pyramid, l), cellMean(pyramid, 0), 1e-7) << "level " << l;
  }
}

// Straight from the definition: cells are means of 2x2x2 vertices, a coarse value the mean of 2x2x2 cells.
TEST(ScalarPyramid, ACoarseValueIsTheMeanOfItsCells_L3) {
  const Lattice lattice = cubeLattice(17);
  const ScalarPyramid pyramid(lattice, noise(lattice), 2, pool);
  const auto cell = [&](const Vec3i& c) {
    double sum = 0;
    for (int i = 0; i < 8; ++i) sum += double(pyramid.value(0, c + Vec3i{i & 1, i >> 1 & 1, i >> 2}));
    return sum / 8;
  };
  for (int z = 1; z < 8; ++z)
    for (int y = 1; y < 8; ++y)
      for (int x = 1; x < 8; ++x) {
        double sum = 0;
        for (int i = 0; i < 8; ++i)
          sum += cell(Vec3i{2 * x, 2 * y, 2 * z} - Vec3i{i & 1, i >> 1 & 1, i >> 2});
        EXPECT_NEAR(pyramid.value(1, {x, y, z}), sum / 8, 1e-7);
      }
}

TEST(ScalarPyramid, AConstantStaysConstantAtEverySize_L3) {
  for (const Vec3i& dims : {Vec3i{222, 17, 9}, {2, 40, 7}, {1, 1, 5}, {31, 32, 33}}) {
    const auto scene = test::constantScene(ElementType::f32, dims, 0.7);
    const ScalarPyramid pyramid(scene.lattice, scene.field, 5, pool);
    for (int l = 0; l < 5; ++l)
      for (float v : pyramid.values(l)) ASSERT_EQ(v, 0.7f) << "level " << l;
  }
}

TEST(ScalarPyramid, ALinearFieldDoesNotMoveWithTheLevel) {
  const Lattice lattice = cubeLattice(33);
  const auto field =
      test::sampledField(lattice, [](const Vec3i& v) { return (v.x + 2.0 * v.y + 3.0 * v.z) / 256; });
  const ScalarPyramid pyramid(lattice, field, 4, pool);
  for (int l = 1; l < 4; ++l) {
    const Vec3i v{1, 2, 3};
    EXPECT_NEAR(pyramid.value(l, v), pyramid.value(0, v * (1 << l)), 1e-6);
  }
}

TEST(ScalarPyramid, HoldsTheVoxelsOfTheSamplingBox) {
  const auto scene = test::plume(ElementType::u8);
  const ScalarPyramid pyramid(scene.lattice, scene.field, 3, pool);
  EXPECT_EQ(pyramid.origin(), scene.lattice.domain.lo - (Vec3i{1, 1, 1}));
  EXPECT_EQ(pyramid.cells(), scene.lattice.domain.size() + (Vec3i{1, 1, 1}));
  const VoxelBox& box = scene.lattice.domain;
  for (int z = box.lo.z; z < box.hi.z; z += 3)
    for (int y = box.lo.y; y < box.hi.y; y += 3)
      for (int x = box.lo.x; x < box.hi.x; ++x) {
        const Vec3i v{x, y, z};
        ASSERT_EQ(double(pyramid.value(0, v - pyramid.origin())), scene.field.value(v));
      }
}

TEST(ScalarPyramid, AbsentVoxelsAreTheBackground) {
  Lattice lattice = cubeLattice(9);
  lattice.background = 0.25;
  std::vector<float> values(729, 0.5f);
  values[100] = std::nanf("");
  values[101] = INFINITY;
  const ScalarPyramid pyramid(lattice, fieldFromDense(values.data(), {9, 9, 9}, 0.25f), 2, pool);
  EXPECT_EQ(pyramid.values(0)[100], 0.25f);
  EXPECT_EQ(pyramid.values(0)[101], 0.25f);
  EXPECT_EQ(pyramid.values(0)[102], 0.5f);
}

TEST(ScalarPyramid, AnUpdateEqualsAFreshBuild) {
  for (const ElementType type : test::kAllTypes) {
    auto before = test::movingBall(type, 48, 0), after = test::movingBall(type, 48, 3);
    ScalarPyramid pyramid(before.lattice, before.field, 5, pool);
    const DirtyBlocks dirty = pyramid.apply(test::differences(before, after));
    const ScalarPyramid fresh(after.lattice, after.field, 5, pool);
    for (int l = 0; l < 5; ++l) {
      EXPECT_EQ(pyramid.values(l), fresh.values(l)) << "level " << l;
      EXPECT_FALSE(dirty.levels[size_t(l)].empty());
    }
    // Far fewer than a fresh build, which computes a seventh of the volume.
    EXPECT_LT(dirty.verticesComputed, fresh.values(1).size() / 4);
    EXPECT_GT(dirty.verticesComputed, 0u);
  }
}

TEST(ScalarPyramid, DirtyBlocksAreThoseThatDiffer) {
  auto before = test::movingBall(ElementType::f32, 48, 0), after = test::movingBall(ElementType::f32, 48, 3);
  ScalarPyramid pyramid(before.lattice, before.field, 3, pool);
  const ScalarPyramid old(before.lattice, before.field, 3, pool);
  const DirtyBlocks& dirty = pyramid.apply(test::differences(before, after));
  for (int l = 0; l < 3; ++l) {
    std::vector<Vec3i> expected;
    const Vec3i n = pyramid.vertices(l);
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x)
          if (pyramid.value(l, {x, y, z}) != old.value(l, {x, y, z}))
            expected.push_back({x / 8, y / 8, z / 8});
    std::sort(expected.begin(), expected.end(), lessZYX);
    expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    EXPECT_EQ(dirty.levels[size_t(l)], expected) << "level " << l;
  }
}

TEST(ScalarPyramid, RefusesChangesOfAnotherVolume) {
  const auto scene = test::plume(ElementType::u8);
  ScalarPyramid pyramid(scene.lattice, scene.field, 2, pool);
  ChangedVoxels floats;
  floats.values = std::vector<float>{};
  EXPECT_THROW(pyramid.apply(floats), StateError);
  ChangedVoxels outside;
  outside.leaves.push_back({{800, 0, 0}, {1}, 0});
  outside.values = std::vector<uint8_t>{1};
  EXPECT_THROW(pyramid.apply(outside), StateError);
}

TEST(ScalarPyramid, TakesItsCoarseLevelsFromAnEarlierRun) {
  const auto scene = test::plume(ElementType::u16);
  const ScalarPyramid built(scene.lattice, scene.field, 4, pool);
  const std::vector<float> coarse = built.coarseValues();
  const ScalarPyramid reused(scene.lattice, scene.field, 4, coarse);
  for (int l = 0; l < 4; ++l) EXPECT_EQ(built.values(l), reused.values(l));
  EXPECT_THROW(ScalarPyramid(scene.lattice, scene.field, 3, coarse), StateError);
}

}  // namespace
}  // namespace kairos
