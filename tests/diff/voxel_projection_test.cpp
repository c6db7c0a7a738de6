// Which pixels a changed voxel influences, against rays followed pixel by pixel.
#include "diff/voxel_projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/scenes.h"

namespace kairos::test {
namespace {

constexpr ProjectionRules kPaperZero{ProjectionOrder::zero, ProjectionMode::paper};
constexpr ProjectionRules kPaperTrilinear{ProjectionOrder::trilinear, ProjectionMode::paper};
constexpr ProjectionRules kConservativeZero{ProjectionOrder::zero, ProjectionMode::conservative};
constexpr ProjectionRules kConservativeTrilinear{ProjectionOrder::trilinear, ProjectionMode::conservative};

/// A lattice with slanted, unequal voxel axes.
Lattice skewedLattice() {
  Lattice lattice = sparseLattice(ElementType::u8, {20, 13, 17}, {-5, 30, 2});
  lattice.worldFromIndex.column = {Vec3d{0.5, 0.1, 0}, Vec3d{-0.05, 0.8, 0.1}, Vec3d{0, 0.1, 0.6}};
  lattice.worldFromIndex.translation = {3, -20, 7};
  return lattice;
}

RenderSettings viewOf(const Lattice& lattice, const std::string& camera, int width = 46, int height = 38) {
  RenderSettings settings;
  settings.camera = cameraNamed(camera, lattice);
  settings.width = width;
  settings.height = height;
  return settings;
}

std::vector<Vec3i> someVoxels(const Lattice& lattice, int count) {
  std::mt19937 random(3);
  std::vector<Vec3i> voxels{lattice.domain.lo, lattice.domain.hi - Vec3i{1, 1, 1}};
  const Vec3i size = lattice.domain.size();
  for (int i = 0; i < count; ++i)
    voxels.push_back(lattice.domain.lo + Vec3i{int32_t(random() % uint32_t(size.x)),
                                               int32_t(random() % uint32_t(size.y)),
                                               int32_t(random() % uint32_t(size.z))});
  return voxels;
}

bool holds(const PixelRows& j, int x, int y) {
  return y >= j.top && y <= j.bottom && x >= j.first[size_t(y)] && x <= j.last[size_t(y)];
}

/// A pixel's ray in index space; t is the world distance from its origin.
Ray indexRay(const RenderSettings& settings, const Lattice& lattice, double x, double y) {
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  const Affine index = lattice.worldFromIndex.inverse();
  const Ray ray = generator.ray(x, y);
  return {index.point(ray.origin), index.vector(ray.direction)};
}

/// Does the ray pass the cube of that half edge around `centre`, in front of its origin?
bool meetsCube(const Ray& ray, const Vec3d& centre, double half) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0) {
      if (std::abs(ray.origin[a] - centre[a]) > half) return false;
      continue;
    }
    double in = (centre[a] - half - ray.origin[a]) / ray.direction[a];
    double out = (centre[a] + half - ray.origin[a]) / ray.direction[a];
    if (in > out) std::swap(in, out);
    enter = std::max(enter, in);
    leave = std::min(leave, out);
  }
  return enter <= leave;
}

class Views : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Views, testing::ValuesIn(cameraNames()), [](const auto& view) {
  return view.param[0] == '-' ? "minus" + view.param.substr(1) : view.param;
});

/// On which side of the plane through all rays of one column (or row) a point lies.
double sideOf(const Ray& first, const Ray& last, const Vec3d& point) {
  const Vec3d a = first.origin + first.direction, b = last.origin + last.direction;
  return dot(cross(b - a, first.direction), point - a);
}

TEST_P(Views, ZeroOrderTakesTheFourPixelsAroundTheProjectedVoxel_D4) {
  for (const Lattice& lattice : {skewedLattice(), denseLattice(ElementType::u8, {30, 30, 30})}) {
    const RenderSettings settings = viewOf(lattice, GetParam());
    const RayGenerator generator(settings.camera, settings.width, settings.height);
    const VoxelProjection projection(settings, lattice, kPaperZero);
    for (const Vec3i& v : someVoxels(lattice, 60)) {
      const PixelRectangle j = projection.rectangle(v);
      const Vec3d p = lattice.worldFromIndex.point(Vec3d(v));
      if (dot(p - settings.camera.eye, generator.forward()) <= 0) {
        EXPECT_TRUE(j.empty());
        continue;
      }
      if (j.empty() || j.x0 == 0 || j.y0 == 0 || j.x1 == settings.width - 1 || j.y1 == settings.height - 1)
        continue;  // cut by the image's edge
      ASSERT_EQ(j.x1, j.x0 + 1);
      ASSERT_EQ(j.y1, j.y0 + 1);
      const auto besideColumn = [&](int x) {
        return sideOf(generator.ray(x + 0.5, 0), generator.ray(x + 0.5, settings.height), p);
      };
      const auto besideRow = [&](int y) {
        return sideOf(generator.ray(0, y + 0.5), generator.ray(settings.width, y + 0.5), p);
      };
      EXPECT_LE(besideColumn(j.x0) * besideColumn(j.x1), 1e-18);
      EXPECT_LE(besideRow(j.y0) * besideRow(j.y1), 1e-18);
    }
  }
}

TEST_P(Views, TrilinearTakesThePixelsWhoseRaysPassTheInterpolationSpace_D5) {
  const Lattice lattice = skewedLattice();
  const RenderSettings settings = viewOf(lattice, GetParam());
  const VoxelProjection projection(settings, lattice, kPaperTrilinear);
  PixelRows j(settings.height);
  int inside = 0;
  for (const Vec3i& v : someVoxels(lattice, 40)) {
    projection.project(v, j);
    for (int y = 0; y < settings.height; ++y)
      for (int x = 0; x < settings.width; ++x) {
        const Ray ray = indexRay(settings, lattice, x + 0.5, y + 0.5);
        const bool met = meetsCube(ray, Vec3d(v), 1 - 1e-9);
        if (met != meetsCube(ray, Vec3d(v), 1 + 1e-9)) continue;  // on the outline
        ASSERT_EQ(holds(j, x, y), met) << v.x << ' ' << v.y << ' ' << v.z << " at " << x << ' ' << y;
        inside += met;
      }
  }
  EXPECT_GT(inside, 0);
}

/// Does a sample of the ray read the voxel, by value or (shaded) by gradient?
bool readsVoxel(const Ray& ray, const RenderSettings& settings, const Lattice& lattice, const Vec3i& v) {
  const double half = (settings.filter == Filter::trilinear ? 1 : 0.5);
  const double step = settings.worldStep(lattice);
  const int samples = int(4 * length(lattice.worldBounds().hi - lattice.worldBounds().lo) / step) + 4;
  const PointBox box = lattice.samplingBox();
  const double toBox =
      std::max(0.0, length(settings.camera.eye - (lattice.worldBounds().lo)) / step - samples);
  for (int64_t k = int64_t(toBox); k < int64_t(toBox) + 2 * samples; ++k) {
    const Vec3d p = ray.origin + ray.direction * ((double(k) + 0.5) * step);
    int beyond = 0;  // axes along which a gradient's footprint has to reach out
    bool read = true;
    for (int a = 0; a < 3; ++a) {
      const double distance = std::abs(p[a] - v[a]);
      read = read && p[a] >= box.lo[a] && p[a] <= box.hi[a] && distance < half + (settings.shade ? 1 : 0);
      beyond += distance >= half;
    }
    if (read && beyond <= 1) return true;
  }
  return false;
}

TEST_P(Views, ConservativeRectanglesHoldEveryPixelThatReadsTheVoxel_D5) {
  const Lattice lattice = skewedLattice();
  RenderSettings settings = viewOf(lattice, GetParam(), 30, 26);
  settings.step = 0.5;
  int reading = 0;
  for (const Filter filter : {Filter::trilinear, Filter::nearest})
    for (const bool shade : {false, true}) {
      settings.filter = filter;
      settings.shade = shade;
      const VoxelProjection zero(settings, lattice, kConservativeZero);
      const VoxelProjection trilinear(settings, lattice, kConservativeTrilinear);
      PixelRows byZero(settings.height), byTrilinear(settings.height);
      for (const Vec3i& v : someVoxels(lattice, 3)) {
        zero.project(v, byZero);
        trilinear.project(v, byTrilinear);
        for (int y = 0; y < settings.height; ++y)
          for (int x = 0; x < settings.width; ++x) {
            if (!readsVoxel(indexRay(settings, lattice, x + 0.5, y + 0.5), settings, lattice, v)) continue;
            ++reading;
            ASSERT_TRUE(holds(byZero, x, y)) << x << ' ' << y;
            ASSERT_TRUE(holds(byTrilinear, x, y)) << x << ' ' << y;
          }
      }
    }
  EXPECT_GT(reading, 0);
}

TEST_P(Views, ConservativeRectanglesHoldThePublishedPixels_D4_D5) {
  const Lattice lattice = skewedLattice();
  const RenderSettings settings = viewOf(lattice, GetParam());
  PixelRows published(settings.height), conservative(settings.height);
  for (const ProjectionOrder order : {ProjectionOrder::zero, ProjectionOrder::trilinear}) {
    const VoxelProjection narrow(settings, lattice, {order, ProjectionMode::paper});
    const VoxelProjection wide(settings, lattice, {order, ProjectionMode::conservative});
    for (const Vec3i& v : someVoxels(lattice, 60)) {
      narrow.project(v, published);
      wide.project(v, conservative);
      for (int y = published.top; y <= published.bottom; ++y)
        for (int x = published.first[size_t(y)]; x <= published.last[size_t(y)]; ++x)
          ASSERT_TRUE(holds(conservative, x, y)) << x << ' ' << y;
    }
  }
}

TEST_P(Views, ACubesRectangleHoldsThoseOfItsVoxels) {
  const Lattice lattice = skewedLattice();
  const RenderSettings settings = viewOf(lattice, GetParam());
  for (const ProjectionRules& rules :
       {kPaperZero, kPaperTrilinear, kConservativeZero, kConservativeTrilinear}) {
    const VoxelProjection projection(settings, lattice, rules);
    for (const Vec3i& v : someVoxels(lattice, 20)) {
      const PixelRectangle all = projection.rectangleOfCube(v, 8);
      for (int i = 0; i < 512; i += 3) {
        const PixelRectangle j = projection.rectangle(v + Vec3i{i & 7, i >> 3 & 7, i >> 6});
        if (j.empty()) continue;
        ASSERT_LE(all.x0, j.x0);
        ASSERT_LE(all.y0, j.y0);
        ASSERT_GE(all.x1, j.x1);
        ASSERT_GE(all.y1, j.y1);
      }
    }
  }
}

TEST(VoxelProjection, VoxelsBehindTheEyeInfluenceNothing) {
  const Lattice lattice = denseLattice(ElementType::u8, {16, 16, 16});
  for (const char* camera : {"iso", "ortho"}) {
    RenderSettings settings = viewOf(lattice, camera);
    const Vec3d forward = normalized(settings.camera.target - settings.camera.eye);
    settings.camera.eye = settings.camera.target + forward * 40;
    settings.camera.target = settings.camera.eye + forward;
    for (const ProjectionRules& rules : {kPaperZero, kPaperTrilinear, kConservativeTrilinear})
      EXPECT_TRUE(VoxelProjection(settings, lattice, rules).rectangle({8, 8, 8}).empty());
  }
}

TEST(VoxelProjection, AVoxelAroundTheEyeInfluencesEveryPixel) {
  const Lattice lattice = denseLattice(ElementType::u8, {16, 16, 16});
  RenderSettings settings = viewOf(lattice, "inside");
  settings.camera.eye = {8.2, 7.9, 8.1};
  settings.camera.target = {0, 1, 2};
  for (const ProjectionRules& rules : {kPaperTrilinear, kConservativeTrilinear}) {
    PixelRows j(settings.height);
    VoxelProjection(settings, lattice, rules).project({8, 8, 8}, j);
    for (int y = 0; y < settings.height; ++y)
      for (int x = 0; x < settings.width; ++x) ASSERT_TRUE(holds(j, x, y)) << x << ' ' << y;
  }
}

}  // namespace
}  // namespace kairos::test
