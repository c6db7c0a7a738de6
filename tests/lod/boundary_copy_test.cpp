#include "lod/boundary_copy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/scenes.h"

namespace kairos {
namespace {

ThreadPool pool(2);

struct Volume {
  test::Scene scene;
  ScalarPyramid pyramid;
  ValueOctree octree;
  Subdivision division;
  explicit Volume(test::Scene s)
      : scene(std::move(s)),
        pyramid(scene.lattice, scene.field, 5, pool),
        octree(pyramid, pool),
        division(octree, pyramid, options()) {}

  static SubdivisionOptions options() {
    SubdivisionOptions options;
    options.minimumEdge = 16;
    options.deviationThreshold = 0.1;
    options.memoryLimit = 300000;
    return options;
  }
};

// Noise, with parts that are still, so that large subvolumes stand beside small ones.
test::Scene unevenNoise() {
  const Lattice lattice = test::denseLattice(ElementType::f32, {90, 64, 70});
  return {"uneven", lattice, test::sampledField(lattice, [](const Vec3i& v) {
            return v.x > 40 && v.y > 30 ? 0.5 + 0.1 * test::whiteNoise(v, 4) : test::whiteNoise(v, 2);
          })};
}

SubvolumeLevels randomLevels(const Subdivision& division, std::mt19937& random) {
  SubvolumeLevels levels;
  for (const Subvolume& s : division.subvolumes()) levels.push_back(uint8_t(random() % unsigned(s.levels)));
  return levels;
}

// The interpolated value at a position within the subvolume, ends included.
double interpolate(const Subvolume& s, int level, const std::vector<float>& texels, const Vec3d& p) {
  const Vec3i n = s.vertices(level);
  int low[3];
  double f[3];
  for (int a = 0; a < 3; ++a) {
    const double x = (p[a] - s.cells.lo[a]) / (1 << level);
    low[a] = std::min(int(x), n[a] - 2);
    f[a] = x - low[a];
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int x = low[0] + (c & 1), y = low[1] + (c >> 1 & 1), z = low[2] + (c >> 2);
    sum += (c & 1 ? f[0] : 1 - f[0]) * (c >> 1 & 1 ? f[1] : 1 - f[1]) * (c >> 2 ? f[2] : 1 - f[2]) *
           double(texels[size_t((z * n.y + y) * n.x + x)]);
  }
  return sum;
}

struct Seams {
  double largestJump = 0;
  int points = 0, acrossLevels = 0;
};

// Random points on all the faces, edges and corners that subvolumes share.
Seams measureSeams(const Volume& volume, const SubvolumeLevels& levels, bool adapted, std::mt19937& random) {
  std::vector<std::vector<float>> texels(volume.division.size());
  for (uint32_t i = 0; i < texels.size(); ++i) {
    SubvolumeLevels seen = levels;
    if (!adapted) std::fill(seen.begin(), seen.end(), levels[i]);
    copyTexels(volume.pyramid, volume.division, seen, i, texels[i]);
  }
  Seams seams;
  std::uniform_real_distribution<double> unit(0, 1);
  for (uint32_t i = 0; i < texels.size(); ++i)
    for (uint32_t j : volume.division.neighbours(i)) {
      if (j < i) continue;
      const Subvolume &a = volume.division.subvolumes()[i], &b = volume.division.subvolumes()[j];
      for (int k = 0; k < 12; ++k, ++seams.points) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) {
          const double lo = std::max(a.cells.lo[axis], b.cells.lo[axis]);
          const double hi = std::min(a.cells.hi[axis], b.cells.hi[axis]);
          p[axis] = lo + (hi - lo) * unit(random);
        }
        const double jump =
            std::abs(interpolate(a, levels[i], texels[i], p) - interpolate(b, levels[j], texels[j], p));
        seams.largestJump = std::max(seams.largestJump, jump);
        seams.acrossLevels += levels[i] != levels[j];
      }
    }
  return seams;
}

TEST(BoundaryCopy, InterpolationAgreesAcrossEveryFaceEdgeAndCorner_L4) {
  const Volume volume(unevenNoise());
  ASSERT_GT(volume.division.size(), 20u);
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Seams seams = measureSeams(volume, randomLevels(volume.division, random), true, random);
    EXPECT_LE(seams.largestJump, 1e-6) << "trial " << trial;
    EXPECT_GT(seams.acrossLevels, seams.points / 4);
  }
}

TEST(BoundaryCopy, WithoutItTheFacesTear_L4) {
  const Volume volume(unevenNoise());
  std::mt19937 random(1);
  EXPECT_GT(measureSeams(volume, randomLevels(volume.division, random), false, random).largestJump, 0.05);
}

TEST(BoundaryCopy, SubvolumesOfEqualLevelNeedNone_L4) {
  const Volume volume(unevenNoise());
  std::mt19937 random(2);
  for (uint8_t level = 0; level < 3; ++level) {
    const SubvolumeLevels levels(volume.division.size(), level);
    EXPECT_LE(measureSeams(volume, levels, false, random).largestJump, 1e-6);
    for (uint32_t i = 0; i < volume.division.size(); ++i)
      EXPECT_EQ(boundarySignature(volume.division, levels, i), 0u);
  }
}

// What the pyramid's level holds at a vertex of level 0.
double pyramidValue(const ScalarPyramid& pyramid, const Vec3i& v, int level) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const Vec3i corner{c & 1, c >> 1 & 1, c >> 2};
    Vec3i at;
    double weight = 1;
    for (int a = 0; a < 3; ++a) {
      const double x = double(v[a]) / (1 << level);
      at[a] = int(x) + corner[a];
      weight *= corner[a] ? x - int(x) : 1 - x + int(x);
    }
    if (weight > 0) sum += weight * double(pyramid.value(level, at));
  }
  return sum;
}

// Chebyshev's distance.
int distance(const Vec3i& v, const VoxelBox& box) {
  int d = 0;
  for (int a = 0; a < 3; ++a) d = std::max({d, box.lo[a] - v[a], v[a] - box.hi[a]});
  return d;
}

// The definition, with all subvolumes of the volume asked, not only those that touch.
double expectedInside(const Volume& volume, const SubvolumeLevels& levels, uint32_t i, const Vec3i& v) {
  double mixed = levels[i];
  for (uint32_t j = 0; j < volume.division.size(); ++j) {
    const double slope = std::max(1 / 4.0, double(levels[j]) / Volume::options().minimumEdge);
    mixed = std::max(mixed, levels[j] - slope * distance(v, volume.division.subvolumes()[j].cells));
  }
  const auto finer = int(mixed);
  const double fine = pyramidValue(volume.pyramid, v, finer), ratio = mixed - finer;
  return ratio > 0 ? (1 - ratio) * fine + ratio * pyramidValue(volume.pyramid, v, finer + 1) : fine;
}

TEST(BoundaryCopy, InsideValuesCoarsenWithTheDistanceFromCoarserSubvolumes_L4) {
  const Volume volume(unevenNoise());
  std::mt19937 random(3);
  const SubvolumeLevels levels = randomLevels(volume.division, random);
  std::vector<float> plain, adapted;
  int changed = 0, kept = 0;
  for (uint32_t i = 0; i < volume.division.size(); ++i) {
    copyTexels(volume.pyramid, volume.division, SubvolumeLevels(volume.division.size(), levels[i]), i, plain);
    copyTexels(volume.pyramid, volume.division, levels, i, adapted);
    const Subvolume& s = volume.division.subvolumes()[i];
    const Vec3i n = s.vertices(levels[i]), first = s.firstVertex(levels[i]);
    for (int z = 1; z < n.z - 1; ++z)
      for (int y = 1; y < n.y - 1; ++y)
        for (int x = 1; x < n.x - 1; ++x) {
          const auto at = size_t((z * n.y + y) * n.x + x);
          const Vec3i v = (first + Vec3i{x, y, z}) * (1 << levels[i]);
          ASSERT_NEAR(adapted[at], expectedInside(volume, levels, i, v), 1e-6) << i << ' ' << x << ' ' << y;
          ++(adapted[at] == plain[at] ? kept : changed);
        }
  }
  EXPECT_GT(changed, 1000);
  EXPECT_GT(kept, 1000);
}

// Beside a subvolume two levels coarser no layer of vertices stands out: detail returns little by little,
// where without transitions it is all there one voxel from the face.
TEST(BoundaryCopy, DetailReturnsGradually_L4) {
  const Lattice lattice = test::denseLattice(ElementType::f32, {64, 33, 33});
  const Volume volume(
      {"noise", lattice, test::sampledField(lattice, [](const Vec3i& v) { return test::whiteNoise(v, 5); })});
  const auto& subvolumes = volume.division.subvolumes();
  SubvolumeLevels levels;
  for (const Subvolume& s : subvolumes) levels.push_back(s.cells.lo.x < 32 ? 2 : 0);
  std::vector<double> squares(33), before(33);
  for (uint32_t i = 0; i < subvolumes.size(); ++i) {
    const Subvolume& s = subvolumes[i];
    if (levels[i]) continue;
    std::vector<float> texels;
    copyTexels(volume.pyramid, volume.division, levels, i, texels);
    const Vec3i n = s.vertices(0);
    for (int z = 0, at = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x, ++at) {
          const Vec3i v = s.cells.lo + Vec3i{x, y, z};
          const double coarse = pyramidValue(volume.pyramid, v, 2);
          squares[size_t(v.x - 32)] += std::pow(texels[size_t(at)] - coarse, 2);
          before[size_t(v.x - 32)] += std::pow(volume.pyramid.value(0, v) - coarse, 2);
        }
  }
  EXPECT_LT(squares[0], 1e-6 * before[0]);
  for (size_t d = 1; d <= 8; ++d) {
    const double share = std::sqrt(squares[d] / before[d]), last = std::sqrt(squares[d - 1] / before[d - 1]);
    EXPECT_GT(share, last) << d;
    EXPECT_LT(share, last + 0.3) << d;
  }
  EXPECT_DOUBLE_EQ(squares[8], before[8]);
}

// The texels may be kept exactly as long as the signature stays the same.
TEST(BoundaryCopy, EqualSignaturesMeanEqualTexels) {
  const Volume volume(unevenNoise());
  std::mt19937 random(4);
  SubvolumeLevels levels = randomLevels(volume.division, random);
  int same = 0, different = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto i = uint32_t(random() % volume.division.size());
    std::vector<float> before, after;
    const uint64_t signature = boundarySignature(volume.division, levels, i);
    copyTexels(volume.pyramid, volume.division, levels, i, before);
    auto j = uint32_t(random() % volume.division.size());
    if (j == i) j = (j + 1) % uint32_t(volume.division.size());
    levels[j] = uint8_t(random() % unsigned(volume.division.subvolumes()[j].levels));
    copyTexels(volume.pyramid, volume.division, levels, i, after);
    if (boundarySignature(volume.division, levels, i) == signature) {
      ++same;
      EXPECT_EQ(before, after);
    } else {
      ++different;
    }
  }
  EXPECT_GT(same, 20);
  EXPECT_GT(different, 5);
}

}  // namespace
}  // namespace kairos
