#include "volume/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/scenes.h"

namespace kairos {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class T>
class FieldOf : public testing::Test {};
using ElementTypes = testing::Types<uint8_t, uint16_t, float>;
TYPED_TEST_SUITE(FieldOf, ElementTypes);

TYPED_TEST(FieldOf, DenseArrayComesBackVoxelByVoxelWhateverItsOriginAndSize) {
  using T = TypeParam;
  const Vec3i origins[] = {{0, 0, 0}, {-13, 5, -8}, {-1, -7, 9}, {1000003, -1000001, 7}};
  const Vec3i sizes[] = {{1, 1, 1}, {7, 9, 17}, {8, 8, 8}, {3, 1, 23}};
  for (const Vec3i& origin : origins)
    for (const Vec3i& dims : sizes) {
      std::vector<T> dense;
      for (int i = 0; i < dims.x * dims.y * dims.z; ++i)
        dense.push_back(T(test::whiteNoise({i, 0, 0}, 5) * 250));
      const T background = T(3);
      const Field field = fieldFromDense(dense.data(), dims, background, origin);
      EXPECT_EQ(field.type(), elementTypeOf<T>());
      EXPECT_EQ(field.bounds, (VoxelBox{origin, origin + dims}));
      for (int z = -2; z < dims.z + 2; ++z)
        for (int y = -2; y < dims.y + 2; ++y)
          for (int x = -2; x < dims.x + 2; ++x) {
            const Vec3i v = origin + Vec3i{x, y, z};
            const bool inside = field.bounds.contains(v);
            const double expected =
                inside ? double(dense[size_t((z * dims.y + y) * dims.x + x)]) : double(background);
            ASSERT_EQ(field.value(v), expected) << v.x << " " << v.y << " " << v.z;
          }
    }
}

TEST(Field, KeepsLeavesSortedUniqueAndOnlyWhereTheyHoldSomething) {
  const auto scene = test::plume(ElementType::u16);
  const Field& field = scene.field;
  ASSERT_GT(field.leafCount(), 1u);
  EXPECT_EQ(size(field.values), field.leafCount() * kLeafVoxels);
  const auto& values = valuesAs<uint16_t>(field.values);
  for (size_t i = 0; i < field.leafCount(); ++i) {
    const Vec3i o = field.leafOrigins[i];
    EXPECT_EQ(leafOriginOf(o), o);
    EXPECT_EQ(field.findLeaf(o), int64_t(i));
    if (i > 0) {
      EXPECT_TRUE(lessZYX(field.leafOrigins[i - 1], o));
    }
    const auto leaf = values.begin() + int64_t(i) * kLeafVoxels;
    EXPECT_TRUE(std::any_of(leaf, leaf + kLeafVoxels, [](uint16_t v) { return v != 0; }));
  }
  EXPECT_EQ(field.findLeaf({8000, 0, 0}), -1);
}

TEST(Field, StoresALeafThatDiffersFromTheBackgroundInBitsOnly) {
  // NaN is not the background, and -0 is not +0: steps are compared bit by bit.
  for (float odd : {kNaN, -0.0f}) {
    std::vector<float> dense(512, 0.0f);
    dense[100] = odd;
    EXPECT_EQ(fieldFromDense(dense.data(), {8, 8, 8}).leafCount(), 1u);
  }
  const std::vector<float> nans(512, kNaN);
  EXPECT_EQ(fieldFromDense(nans.data(), {8, 8, 8}, kNaN).leafCount(), 0u);
}

TEST(Field, ADenseArrayOfNothingIsEmpty) {
  const uint8_t none = 0;
  const Field field = fieldFromDense(&none, {0, 5, 5});
  EXPECT_EQ(field.leafCount(), 0u);
  EXPECT_TRUE(field.bounds.empty());
  EXPECT_EQ(field.value({0, 0, 0}), 0.0);
}

TEST(FieldStatistics, CoverFiniteVoxelsAndTheBackgroundAndCountTheRest) {
  std::vector<float> dense(4 * 4 * 4, 2.0f);
  dense[3] = kNaN;
  dense[9] = -kInfinity;
  dense[10] = kInfinity;
  dense[20] = -7.5f;
  dense[21] = 11.25f;
  const FieldStatistics s = fieldStatistics(fieldFromDense(dense.data(), {4, 4, 4}, 2.0f));
  EXPECT_EQ(s.lo, -7.5);
  EXPECT_EQ(s.hi, 11.25);
  EXPECT_EQ(s.nonFinite, 3);

  const FieldStatistics withBackground = fieldStatistics(fieldFromDense(dense.data(), {4, 4, 4}, 100.0f));
  EXPECT_EQ(withBackground.hi, 100.0);
}

TEST(FieldStatistics, OfAnIntegerFieldAndOfAnEmptyOne) {
  const std::vector<uint16_t> dense{7, 65535, 9};
  const FieldStatistics s = fieldStatistics(fieldFromDense(dense.data(), {3, 1, 1}));
  EXPECT_EQ(s.lo, 0.0);
  EXPECT_EQ(s.hi, 65535.0);
  EXPECT_EQ(s.nonFinite, 0);
  Field empty;
  empty.background = -3;
  empty.values = makeVoxelArray(ElementType::f32);
  EXPECT_EQ(fieldStatistics(empty).lo, -3.0);
  EXPECT_EQ(fieldStatistics(empty).hi, -3.0);
}

TEST(FieldStatistics, CountANonFiniteBackgroundAsTheZeroItIsRenderedAs) {
  const std::vector<float> dense(512, 5.0f);
  const FieldStatistics s = fieldStatistics(fieldFromDense(dense.data(), {8, 8, 8}, kNaN));
  EXPECT_EQ(s.lo, 0.0);
  EXPECT_EQ(s.hi, 5.0);
  EXPECT_EQ(s.nonFinite, 0);
}

TEST(Lattice, DenseDataEndsAtTheOutermostVoxelCentres) {
  const Lattice lattice = test::denseLattice(ElementType::u8, {10, 1, 4}, {-3, 2, 0});
  EXPECT_EQ(lattice.samplingBox(), (PointBox{{-3, 1.5, 0}, {6, 2.5, 3}}));
}

TEST(Lattice, SparseDataFadesWithinOneVoxel) {
  const Lattice lattice = test::sparseLattice(ElementType::u8, {10, 1, 4}, {-3, 2, 0});
  EXPECT_EQ(lattice.samplingBox(), (PointBox{{-4, 1, -1}, {7, 3, 4}}));
}

TEST(Lattice, AnEmptyDomainHasNoExtent) {
  Lattice lattice;
  const PointBox box = lattice.samplingBox();
  EXPECT_EQ(box.lo, box.hi);
}

TEST(Lattice, WorldBoundsHoldTheRotatedBox) {
  Lattice lattice = test::denseLattice(ElementType::u8, {11, 21, 31});
  // A quarter turn about z, x stretched by 2, moved.
  lattice.worldFromIndex = {{Vec3d{0, 2, 0}, Vec3d{-1, 0, 0}, Vec3d{0, 0, 1}}, {100, 0, -5}};
  const PointBox world = lattice.worldBounds();
  EXPECT_EQ(world.lo, (Vec3d{80, 0, -5}));
  EXPECT_EQ(world.hi, (Vec3d{100, 20, 25}));
}

}  // namespace
}  // namespace kairos
