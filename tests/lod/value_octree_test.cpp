#include "lod/value_octree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "lod/differences.h"
#include "support/scenes.h"

namespace kairos {
namespace {

ThreadPool pool(2);

struct Volume {
  test::Scene scene;
  ScalarPyramid pyramid;
  ValueOctree octree;
  explicit Volume(test::Scene s)
      : scene(std::move(s)), pyramid(scene.lattice, scene.field, 4, pool), octree(pyramid, pool) {}
};

// Every vertex of the box, two passes.
NodeStatistics bruteForce(const ScalarPyramid& pyramid, const VoxelBox& box) {
  NodeStatistics s;
  std::vector<double> values;
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      for (int x = box.lo.x; x < box.hi.x; ++x) values.push_back(double(pyramid.value(0, {x, y, z})));
  s.count = int64_t(values.size());
  for (double v : values) s.mean += v / double(values.size());
  for (double v : values) s.squares += (v - s.mean) * (v - s.mean);
  return s;
}

VoxelBox boxOf(const ScalarPyramid& pyramid, int edge, const Vec3i& node) {
  const Vec3i lo = node * edge;
  return {lo, componentMin(lo + Vec3i{edge, edge, edge}, pyramid.vertices(0))};
}

TEST(ValueOctree, EveryNodeEqualsBruteForce_L1) {
  for (const Vec3i& dims : {Vec3i{40, 33, 17}, {64, 8, 9}, {7, 5, 3}}) {
    const Lattice lattice = test::denseLattice(ElementType::f32, dims);
    const Volume volume({"noise", lattice, test::sampledField(lattice, [](const Vec3i& v) {
                           return test::whiteNoise(v, 5) + 0.01 * v.x;
                         })});
    int nodes = 0;
    for (int h = 0; h <= volume.octree.height(); ++h) {
      const Vec3i n = volume.octree.nodes(h);
      for (int z = 0; z < n.z; ++z)
        for (int y = 0; y < n.y; ++y)
          for (int x = 0; x < n.x; ++x, ++nodes) {
            const NodeStatistics& found = volume.octree.node(h, {x, y, z});
            const NodeStatistics expected =
                bruteForce(volume.pyramid, boxOf(volume.pyramid, ValueOctree::edge(h), {x, y, z}));
            EXPECT_EQ(found.count, expected.count);
            EXPECT_NEAR(found.mean, expected.mean, 1e-12);
            EXPECT_NEAR(found.deviation(), expected.deviation(), 1e-12);
          }
    }
    EXPECT_EQ(volume.octree.nodes(volume.octree.height()), (Vec3i{1, 1, 1}));
    EXPECT_EQ(nodes, int(volume.octree.all().size()));
  }
}

TEST(ValueOctree, LargeOffsetsDoNotDrownSmallDeviations_L1) {
  const Lattice lattice = test::denseLattice(ElementType::f32, {32, 32, 32});
  const Volume volume({"offset", lattice, test::sampledField(lattice, [](const Vec3i& v) {
                         return 100000.0 + (v.x + v.y + v.z) % 2;
                       })});
  EXPECT_NEAR(volume.octree.node(volume.octree.height(), {0, 0, 0}).deviation(), 0.5, 1e-9);
}

TEST(ValueOctree, DeviationWithinBlocksEqualsBruteForce_L1) {
  const Volume volume(test::denseNoise(ElementType::u16, 40));
  for (int level = 0; level <= 5; ++level) {
    const int edge = 1 << level;
    const VoxelBox box{{0, 0, 0}, volume.pyramid.vertices(0)};
    double squares = 0;
    for (int z = 0; z < box.hi.z; z += edge)
      for (int y = 0; y < box.hi.y; y += edge)
        for (int x = 0; x < box.hi.x; x += edge)
          squares +=
              bruteForce(volume.pyramid, {{x, y, z}, componentMin({x + edge, y + edge, z + edge}, box.hi)})
                  .squares;
    const double expected = std::sqrt(squares / double(box.voxelCount()));
    EXPECT_NEAR(volume.octree.deviationWithin(box, level), expected, 1e-9 * (1 + expected));
  }
}

TEST(ValueOctree, AnUpdateEqualsAFreshBuild_L1) {
  Volume volume(test::movingBall(ElementType::f32, 48, 0));
  const test::Scene after = test::movingBall(ElementType::f32, 48, 3);
  const DirtyBlocks& dirty = volume.pyramid.apply(test::differences(volume.scene, after));
  volume.octree.update(volume.pyramid, dirty.levels[0]);
  const ValueOctree fresh(volume.pyramid, pool);
  EXPECT_EQ(volume.octree.all(), fresh.all());
}

TEST(ValueOctree, IsTakenFromAnEarlierRun) {
  const Volume volume(test::plume(ElementType::u8));
  const auto all = volume.octree.all();
  EXPECT_EQ(ValueOctree(volume.pyramid, all).all(), all);
  EXPECT_THROW(ValueOctree(volume.pyramid, std::span(all).first(3)), StateError);
}

}  // namespace
}  // namespace kairos
