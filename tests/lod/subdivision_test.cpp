#include "lod/subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/error.h"
#include "support/scenes.h"

namespace kairos {
namespace {

ThreadPool pool(2);

struct Volume {
  test::Scene scene;
  ScalarPyramid pyramid;
  ValueOctree octree;
  explicit Volume(test::Scene s)
      : scene(std::move(s)), pyramid(scene.lattice, scene.field, 6, pool), octree(pyramid, pool) {}
  Subdivision divide(const SubdivisionOptions& options) const { return {octree, pyramid, options}; }
};

// Noise in one corner of otherwise still space.
test::Scene cornerNoise() {
  const Lattice lattice = test::denseLattice(ElementType::f32, {129, 129, 129});
  return {"corner", lattice, test::sampledField(lattice, [](const Vec3i& v) {
            return v.x < 30 && v.y < 30 && v.z < 30 ? test::whiteNoise(v, 1) : 0.5;
          })};
}

uint64_t textureBytes(const Subvolume& s) {
  const Vec3i n = s.vertices(0);
  return uint64_t(n.x) * uint64_t(n.y) * uint64_t(n.z) * 4;
}

TEST(Subdivision, ANodeLargerThanTheMemoryLimitIsSplit_L2) {
  const Volume volume(test::constantScene(ElementType::f32, {129, 129, 129}, 0.5));
  SubdivisionOptions options;
  options.minimumEdge = 8;
  options.deviationThreshold = 1;
  for (const auto& [limit, count] :
       {std::pair{129 * 129 * 129 * 4, 1}, {129 * 129 * 129 * 4 - 1, 8}, {65 * 65 * 65 * 4 - 1, 64}}) {
    options.memoryLimit = uint64_t(limit);
    const Subdivision division = volume.divide(options);
    EXPECT_EQ(int(division.size()), count) << limit;
    for (const Subvolume& s : division.subvolumes()) EXPECT_LE(textureBytes(s), options.memoryLimit);
  }
}

TEST(Subdivision, ANodeThatVariesMoreThanTheThresholdIsSplit_L2) {
  const Volume volume(cornerNoise());
  SubdivisionOptions options;
  options.memoryLimit = ~uint64_t(0);
  options.minimumEdge = 16;
  options.deviationThreshold = 1;
  EXPECT_EQ(volume.divide(options).size(), 1u);
  options.deviationThreshold = 0.01;
  const Subdivision division = volume.divide(options);
  std::set<int> edges;
  for (const Subvolume& s : division.subvolumes()) {
    edges.insert(s.edge);
    const Vec3i node{s.cells.lo.x / s.edge, s.cells.lo.y / s.edge, s.cells.lo.z / s.edge};
    int height = 0;
    while (ValueOctree::edge(height) < s.edge) ++height;
    if (s.edge > options.minimumEdge) {
      EXPECT_LE(volume.octree.node(height, node).deviation(), options.deviationThreshold);
    }
  }
  EXPECT_EQ(edges, (std::set<int>{16, 32, 64})) << "subvolumes of different sizes";
}

TEST(Subdivision, EveryCellBelongsToOneSubvolume_L2) {
  for (const auto& scene : {test::plume(ElementType::f32, 77), cornerNoise(),
                            test::constantScene(ElementType::f32, {70, 1, 33}, 1)}) {
    const Volume volume(scene);
    SubdivisionOptions options;
    options.minimumEdge = 8;
    options.deviationThreshold = 0.02;
    options.memoryLimit = 40000;
    const Subdivision division = volume.divide(options);
    const Vec3i cells = volume.pyramid.cells();
    int64_t owned = 0;
    for (uint32_t i = 0; i < division.size(); ++i) {
      const Subvolume& s = division.subvolumes()[i];
      owned += s.cells.voxelCount();
      EXPECT_EQ(division.at(s.cells.lo), i);
      EXPECT_EQ(division.at(s.cells.hi - Vec3i{1, 1, 1}), i);
      const Vec3i lastOwned = s.firstVertex(s.levels - 1) + s.vertices(s.levels - 1);
      EXPECT_EQ(componentMin(lastOwned, volume.pyramid.vertices(s.levels - 1)), lastOwned);
    }
    EXPECT_EQ(owned, int64_t(cells.x) * cells.y * cells.z);
  }
}

TEST(Subdivision, LevelsEndAtTheMinimumResolution_L3) {
  const Volume volume(cornerNoise());
  SubdivisionOptions options;
  options.minimumEdge = 32;
  options.deviationThreshold = 0.01;
  const Subdivision division = volume.divide(options);
  for (const Subvolume& s : division.subvolumes()) {
    EXPECT_EQ(s.edge >> (s.levels - 1), options.minimumResolution);
    EXPECT_GE(s.levels, 4);
    EXPECT_LE(s.levels, 5);
  }
}

// Along random rays, subvolumes are entered in the order given.
TEST(Subdivision, FrontToBackOrderHidesNothing_L5) {
  const Volume volume(cornerNoise());
  SubdivisionOptions options;
  options.minimumEdge = 16;
  options.deviationThreshold = 0.01;
  const Subdivision division = volume.divide(options);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-60, 190), inside(0, 127.9);
  std::vector<uint32_t> order;
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3d target{inside(random), inside(random), inside(random)};
    const Vec3d eye{anywhere(random), anywhere(random), anywhere(random)};
    const bool parallel = trial % 2;
    division.frontToBack(parallel ? target - eye : eye, parallel, order);
    ASSERT_EQ(order.size(), division.size());
    std::vector<size_t> rank(order.size());
    for (size_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
    size_t last = 0;
    for (double t = 0; t < 2; t += 1.0 / 256) {
      const Vec3d p = eye + (target - eye) * t;
      const Vec3i cell{int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))};
      if (!VoxelBox{{0, 0, 0}, volume.pyramid.cells()}.contains(cell)) continue;
      const size_t now = rank[division.at(cell)];
      ASSERT_GE(now, last) << "trial " << trial;
      last = now;
    }
  }
}

TEST(Subdivision, NeighboursTouch) {
  const Volume volume(cornerNoise());
  SubdivisionOptions options;
  options.deviationThreshold = 0.01;
  const Subdivision division = volume.divide(options);
  for (uint32_t i = 0; i < division.size(); ++i)
    for (uint32_t j : division.neighbours(i)) {
      const auto& back = division.neighbours(j);
      EXPECT_TRUE(std::find(back.begin(), back.end(), i) != back.end());
      EXPECT_NE(i, j);
    }
}

TEST(Subdivision, RefusesOptionsThatMakeNoSense) {
  const Volume volume(test::plume(ElementType::u8));
  SubdivisionOptions options;
  options.minimumEdge = 24;
  EXPECT_THROW(volume.divide(options), OptionError);
  options.minimumEdge = 16;
  options.minimumResolution = 32;
  EXPECT_THROW(volume.divide(options), OptionError);
  options.minimumResolution = 4;
  options.deviationThreshold = -1;
  EXPECT_THROW(volume.divide(options), OptionError);
}

}  // namespace
}  // namespace kairos
