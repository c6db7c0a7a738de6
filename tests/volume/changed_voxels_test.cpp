#include "volume/changed_voxels.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/error.h"
#include "support/changes.h"
#include "support/scenes.h"

namespace kairos {
namespace {

using test::VoxelMap;

// What the field must hold: `model` over the background.
void expectEquals(const Field& field, const VoxelMap& model, double background) {
  ASSERT_EQ(size(field.values), field.leafCount() * kLeafVoxels);
  for (size_t i = 1; i < field.leafCount(); ++i)
    ASSERT_TRUE(lessZYX(field.leafOrigins[i - 1], field.leafOrigins[i])) << i;
  for (const auto& [v, value] : model) {
    ASSERT_EQ(field.value(v), value) << v.x << " " << v.y << " " << v.z;
    ASSERT_TRUE(field.bounds.contains(v));
  }
  for (const Vec3i& origin : field.leafOrigins)
    for (int i = 0; i < kLeafVoxels; ++i) {
      const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
      if (!model.contains(v)) {
        ASSERT_EQ(field.value(v), background) << v.x << " " << v.y << " " << v.z;
      }
    }
}

Field emptyField(ElementType type, double background) {
  Field field;
  field.background = background;
  field.values = makeVoxelArray(type);
  return field;
}

TEST(ApplyChanges, FollowsABruteForceModelThroughRandomSteps) {
  std::mt19937 random(11);
  for (ElementType type : test::kAllTypes) {
    const double background = type == ElementType::f32 ? -2.5 : 7;
    Field field = emptyField(type, background);
    VoxelMap model;
    for (int step = 0; step < 40; ++step) {
      // Boxes that wander, so that leaves come in front of, between and behind those that exist.
      std::uniform_int_distribution<int> corner(-40, 30), extent(1, 30);
      const Vec3i lo{corner(random), corner(random), corner(random)};
      const VoxelBox box{lo, lo + Vec3i{extent(random), extent(random), extent(random)}};
      const VoxelMap written = test::randomVoxels(type, box, 60, background, random);
      applyChanges(test::changesOf(type, written), field);
      for (const auto& [v, value] : written) model[v] = value;
      expectEquals(field, model, background);
      if (testing::Test::HasFatalFailure()) FAIL() << name(type) << " step " << step;
    }
  }
}

TEST(ApplyChanges, InsertsLeavesInFrontInTheMiddleAndAtTheBack) {
  const auto leafAt = [](int i) { return Vec3i{8 * i, 0, 0}; };
  const std::vector<std::vector<int>> insertions{
      {0}, {3}, {9}, {0, 1}, {8, 9}, {0, 3, 9}, {1, 3, 5, 7}, {0, 2, 4, 6, 8}, {2, 3, 4}};
  for (const auto& insertion : insertions) {
    VoxelMap model;
    for (int i : {2, 4, 5, 6}) model[leafAt(i) + Vec3i{i, 0, 0}] = i + 1;
    Field field = emptyField(ElementType::u8, 0);
    applyChanges(test::changesOf(ElementType::u8, model), field);
    VoxelMap written;
    for (int i : insertion) written[leafAt(i) + Vec3i{7, 7, 7}] = 100 + i;
    applyChanges(test::changesOf(ElementType::u8, written), field);
    model.insert(written.begin(), written.end());
    expectEquals(field, model, 0);
  }
}

TEST(ApplyChanges, KeepsNaN) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Field field = emptyField(ElementType::f32, 0);
  applyChanges(test::changesOf(ElementType::f32, {{{-1, -1, -1}, nan}}), field);
  EXPECT_TRUE(std::isnan(field.value({-1, -1, -1})));
}

TEST(ApplyChanges, OfNothingChangesNothing) {
  auto scene = test::plume(ElementType::u8);
  const Field before = scene.field;
  applyChanges(test::changesOf(ElementType::u8, {}), scene.field);
  EXPECT_EQ(scene.field.leafOrigins, before.leafOrigins);
  EXPECT_EQ(scene.field.values, before.values);
  EXPECT_EQ(scene.field.bounds, before.bounds);
}

TEST(ApplyChanges, RefusesAnotherElementTypeAndNamesBoth) {
  Field field = emptyField(ElementType::u8, 0);
  try {
    applyChanges(test::changesOf(ElementType::f32, {{{0, 0, 0}, 1.0}}), field);
    FAIL() << "accepted";
  } catch (const StateError& e) {
    EXPECT_NE(std::string(e.what()).find("f32"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("u8"), std::string::npos) << e.what();
  }
  EXPECT_EQ(field.leafCount(), 0u);
}

TEST(ChangedVoxels, LocateFindsEveryOneInStorageOrder) {
  std::mt19937 random(3);
  for (size_t count : {1, 5, 700, 20000}) {
    const VoxelBox box{{-21, -9, -30}, {19, 22, 11}};
    VoxelMap voxels = test::randomVoxels(ElementType::u16, box, count, 0, random);
    if (count == 700)  // a full leaf, whose 512 bits are all set
      for (int i = 0; i < kLeafVoxels; ++i) voxels[Vec3i{-8 + (i & 7), (i >> 3) & 7, i >> 6}] = i;
    const ChangedVoxels changes = test::changesOf(ElementType::u16, voxels);
    ASSERT_EQ(changes.count(), voxels.size());
    test::VoxelMap seen;
    for (uint64_t i = 0; i < changes.count(); ++i)
      seen[changes.locate(i)] = double(valuesAs<uint16_t>(changes.values)[i]);
    ASSERT_EQ(seen, voxels) << count;
  }
}

TEST(ChangedVoxels, BoundsHoldEveryLeafAndNothingElse) {
  EXPECT_TRUE(test::changesOf(ElementType::u8, {}).bounds().empty());
  EXPECT_TRUE(test::changesOf(ElementType::u8, {}).empty());
  const ChangedVoxels changes = test::changesOf(ElementType::u8, {{{-1, 3, 3}, 1}, {{20, 3, -9}, 1}});
  EXPECT_EQ(changes.bounds(), (VoxelBox{{-8, 0, -16}, {24, 8, 8}}));
}

}  // namespace
}  // namespace kairos
