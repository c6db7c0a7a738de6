#include "core/vec3.h"

#include <gtest/gtest.h>

#include "core/affine.h"
#include "core/box.h"

namespace kairos {
namespace {

void expectNear(const Vec3d& a, const Vec3d& b, double tolerance = 1e-12) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], tolerance) << "axis " << axis;
}

// Rotated by 30 degrees about z, anisotropic, sheared and moved.
const Affine kOblique{
    {Vec3d{0.5 * std::sqrt(3.0), 0.5, 0}, Vec3d{-1.0, std::sqrt(3.0), 0.25}, Vec3d{0.1, 0, 0.75}},
    Vec3d{-7, 11, 0.5}};

TEST(Vec3, CrossProductIsRightHanded) {
  EXPECT_EQ(cross(Vec3i{1, 0, 0}, Vec3i{0, 1, 0}), (Vec3i{0, 0, 1}));
  EXPECT_EQ(cross(Vec3i{0, 1, 0}, Vec3i{0, 0, 1}), (Vec3i{1, 0, 0}));
  EXPECT_EQ(dot(cross(Vec3i{3, -2, 7}, Vec3i{1, 5, 4}), Vec3i{3, -2, 7}), 0);
}

TEST(Vec3, NormalizedHasUnitLengthAndTheSameDirection) {
  const Vec3d n = normalized(Vec3d{3, -4, 12});
  expectNear(n, {3.0 / 13, -4.0 / 13, 12.0 / 13});
  EXPECT_DOUBLE_EQ(length(n), 1);
}

TEST(Vec3, OrdersVoxelsWithXFastestAndZSlowest) {
  EXPECT_TRUE(lessZYX({9, 9, 0}, {0, 0, 1}));
  EXPECT_TRUE(lessZYX({9, 0, 1}, {0, 1, 1}));
  EXPECT_TRUE(lessZYX({-2, 1, 1}, {-1, 1, 1}));
  EXPECT_FALSE(lessZYX({1, 1, 1}, {1, 1, 1}));
}

TEST(Vec3, FloorToMultipleRoundsDownOnBothSidesOfZero) {
  for (int step : {1, 3, 8, 16})
    for (int v = -50; v <= 50; ++v) {
      const int f = floorToMultiple(v, step);
      EXPECT_EQ(f % step, 0) << v << " to " << step;
      EXPECT_LE(f, v);
      EXPECT_GT(f + step, v);
    }
}

TEST(Affine, InverseUndoesAnObliqueMapBothWays) {
  const Affine inverse = kOblique.inverse();
  for (const Vec3d& p : {Vec3d{0, 0, 0}, Vec3d{1, 2, 3}, Vec3d{-40, 17.5, 900}}) {
    expectNear(inverse.point(kOblique.point(p)), p, 1e-10);
    expectNear(kOblique.point(inverse.point(p)), p, 1e-10);
  }
  EXPECT_NEAR(inverse.determinant() * kOblique.determinant(), 1, 1e-12);
}

TEST(Affine, VectorsIgnoreTheTranslation) {
  expectNear(kOblique.point({1, 2, 3}) - kOblique.point({0, 0, 0}), kOblique.vector({1, 2, 3}));
}

TEST(Affine, GradientsTransformByTheInverseTranspose) {
  // f(world) = dot(g, world); its gradient in index space is linear^T g, and back.
  const Vec3d gWorld{0.3, -2, 5};
  const Vec3d gIndex = kOblique.transposedVector(gWorld);
  for (const Vec3d& d : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    EXPECT_NEAR(dot(gIndex, d), dot(gWorld, kOblique.vector(d)), 1e-12);
  expectNear(kOblique.inverse().transposedVector(gIndex), gWorld);
}

TEST(Affine, VoxelSizeIsTheShortestEdge) {
  EXPECT_DOUBLE_EQ(Affine::scale({0.5, 0.25, 3}).voxelSize(), 0.25);
  EXPECT_DOUBLE_EQ(Affine::scale({0.5, 0.25, 3}).determinant(), 0.375);
}

TEST(Affine, SingularMapsHaveDeterminantZero) {
  EXPECT_EQ(Affine::scale({1, 0, 1}).determinant(), 0);
}

TEST(VoxelBox, CountsBeyond32Bits) {
  EXPECT_EQ((VoxelBox{{-2048, -2048, -2048}, {2048, 2048, 2048}}).voxelCount(), int64_t(1) << 36);
}

TEST(VoxelBox, DefaultAndInvertedBoxesAreEmpty) {
  EXPECT_TRUE(VoxelBox{}.empty());
  const VoxelBox inverted{{5, 0, 0}, {4, 9, 9}};
  EXPECT_TRUE(inverted.empty());
  EXPECT_EQ(inverted.voxelCount(), 0);
  EXPECT_EQ(inverted.size(), Vec3i{});
}

TEST(VoxelBox, ContainsItsLowCornerButNotItsHighOne) {
  const VoxelBox box{{-1, 2, 3}, {4, 5, 6}};
  EXPECT_TRUE(box.contains(Vec3i{-1, 2, 3}));
  EXPECT_TRUE(box.contains(Vec3i{3, 4, 5}));
  for (const Vec3i& outside : {Vec3i{4, 4, 5}, Vec3i{3, 5, 5}, Vec3i{3, 4, 6}, Vec3i{-2, 2, 3}})
    EXPECT_FALSE(box.contains(outside));
}

TEST(VoxelBox, ContainsBoxes) {
  const VoxelBox box{{0, 0, 0}, {8, 8, 8}};
  EXPECT_TRUE(box.contains(box));
  EXPECT_TRUE(box.contains(VoxelBox{}));
  EXPECT_TRUE(box.contains(VoxelBox{{100, 100, 100}, {100, 100, 100}})) << "an empty box lies in every box";
  EXPECT_FALSE(box.contains(VoxelBox{{0, 0, 0}, {8, 8, 9}}));
  EXPECT_FALSE(box.contains(VoxelBox{{-1, 0, 0}, {8, 8, 8}}));
}

TEST(VoxelBox, UniteIgnoresEmptyBoxes) {
  const VoxelBox a{{0, 0, 0}, {2, 2, 2}}, b{{-3, 1, 5}, {1, 2, 6}}, nothing{{90, 90, 90}, {0, 0, 0}};
  EXPECT_EQ(unite(a, b), (VoxelBox{{-3, 0, 0}, {2, 2, 6}}));
  EXPECT_EQ(unite(a, nothing), a);
  EXPECT_EQ(unite(nothing, a), a);
  EXPECT_TRUE(unite(nothing, VoxelBox{}).empty());
}

}  // namespace
}  // namespace kairos
