#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <set>

#include "support/changes.h"
#include "support/scenes.h"
#include "volume/changed_voxels.h"

namespace kairos {
namespace {

uint64_t bitsAt(const Field& field, const Vec3i& v) {
  const double value = field.value(v);
  return field.type() == ElementType::f32 ? std::bit_cast<uint32_t>(float(value)) : uint64_t(value);
}

uint64_t backgroundBits(const Field& field) {
  return field.type() == ElementType::f32 ? std::bit_cast<uint32_t>(float(field.background))
                                          : uint64_t(field.background);
}

TEST(StateChecksum, IsKeptUpToDateByTheChangesAlone) {
  std::mt19937 random(5);
  for (ElementType type : test::kAllTypes) {
    Field field = test::plume(type).field;
    uint64_t kept = stateChecksum(field);
    for (int step = 0; step < 20; ++step) {
      const auto written = test::randomVoxels(type, {{-30, -30, -30}, {30, 30, 30}}, 300, 0, random);
      std::vector<uint64_t> before;
      for (const auto& [v, value] : written) before.push_back(bitsAt(field, v));
      applyChanges(test::changesOf(type, written), field);
      size_t i = 0;
      for (const auto& [v, value] : written)
        kept += voxelChecksum(v, bitsAt(field, v), backgroundBits(field)) -
                voxelChecksum(v, before[i++], backgroundBits(field));
      ASSERT_EQ(kept, stateChecksum(field)) << name(type) << " step " << step;
    }
  }
}

TEST(StateChecksum, DependsOnTheStateNotOnTheWayThere) {
  std::mt19937 random(6);
  const auto a = test::randomVoxels(ElementType::f32, {{0, 0, 0}, {40, 20, 9}}, 500, 0, random);
  const auto b = test::randomVoxels(ElementType::f32, {{50, 0, 0}, {70, 20, 9}}, 500, 0, random);
  Field ab, ba;
  ab.values = ba.values = makeVoxelArray(ElementType::f32);
  applyChanges(test::changesOf(ElementType::f32, a), ab);
  applyChanges(test::changesOf(ElementType::f32, b), ab);
  applyChanges(test::changesOf(ElementType::f32, b), ba);
  applyChanges(test::changesOf(ElementType::f32, a), ba);
  EXPECT_EQ(stateChecksum(ab), stateChecksum(ba));
  EXPECT_NE(stateChecksum(ab), 0u);
}

TEST(StateChecksum, IgnoresStoredBackground) {
  Field field;
  field.values = makeVoxelArray(ElementType::u8);
  applyChanges(test::changesOf(ElementType::u8, {{{3, 3, 3}, 9}}), field);
  applyChanges(test::changesOf(ElementType::u8, {{{3, 3, 3}, 0}}), field);
  EXPECT_EQ(field.leafCount(), 1u);
  EXPECT_EQ(stateChecksum(field), 0u);
}

TEST(StateChecksum, TellsPositionsValuesAndSignsOfZeroApart) {
  std::set<uint64_t> seen;
  size_t terms = 0;
  for (int z = -6; z < 6; ++z)
    for (int y = -6; y < 6; ++y)
      for (int x = -6; x < 6; ++x)
        for (uint64_t value : {1ull, 2ull, 0x3f800000ull, 0x80000000ull}) {
          seen.insert(voxelChecksum({x, y, z}, value, 0));
          ++terms;
        }
  EXPECT_EQ(seen.size(), terms);
  EXPECT_FALSE(seen.contains(0));
}

TEST(StateChecksum, NoticesTwoVoxelsThatSwapTheirValues) {
  const auto checksum = [](double first, double second) {
    Field field;
    field.values = makeVoxelArray(ElementType::u8);
    applyChanges(test::changesOf(ElementType::u8, {{{1, 2, 3}, first}, {{2, 1, 3}, second}}), field);
    return stateChecksum(field);
  };
  EXPECT_NE(checksum(10, 20), checksum(20, 10));
}

// ---- the content of a set of changes ----

ChangedVoxels someChanges(ElementType type, size_t count) {
  std::mt19937 random(9);
  return test::changesOf(type, test::randomVoxels(type, {{-20, -20, -20}, {20, 20, 20}}, count, 0, random));
}

TEST(ContentChecksum, NoticesAnyFlippedBit) {
  for (ElementType type : test::kAllTypes)
    for (size_t count : {1, 3, 40}) {
      ChangedVoxels changes = someChanges(type, count);
      std::set<uint64_t> seen{contentChecksum(changes)};
      size_t variants = 1;
      const auto check = [&] {
        seen.insert(contentChecksum(changes));
        ++variants;
      };
      dispatch(type, [&]<class T>() {
        auto& values = valuesAs<T>(changes.values);
        auto* bytes = reinterpret_cast<unsigned char*>(values.data());
        for (size_t bit = 0; bit < values.size() * sizeof(T) * 8; ++bit) {
          bytes[bit / 8] = static_cast<unsigned char>(bytes[bit / 8] ^ 1u << bit % 8);
          check();
          bytes[bit / 8] = static_cast<unsigned char>(bytes[bit / 8] ^ 1u << bit % 8);
        }
      });
      for (ChangedLeaf& leaf : changes.leaves) {
        for (int bit = 0; bit < kLeafVoxels; ++bit) {
          leaf.mask[size_t(bit / 64)] ^= uint64_t(1) << bit % 64;
          check();
          leaf.mask[size_t(bit / 64)] ^= uint64_t(1) << bit % 64;
        }
        for (int a = 0; a < 3; ++a)
          for (int bit = 0; bit < 32; ++bit) {
            leaf.origin[a] ^= int32_t(1u << bit);
            check();
            leaf.origin[a] ^= int32_t(1u << bit);
          }
      }
      EXPECT_EQ(seen.size(), variants) << name(type) << " " << count;
    }
}

TEST(ContentChecksum, TellsTypesAndLengthsApart) {
  std::set<uint64_t> seen;
  for (ElementType type : test::kAllTypes) seen.insert(contentChecksum(test::changesOf(type, {})));
  EXPECT_EQ(seen.size(), 3u);
  ChangedVoxels changes = someChanges(ElementType::u8, 8);
  const uint64_t whole = contentChecksum(changes);
  valuesAs<uint8_t>(changes.values).push_back(0);
  EXPECT_NE(contentChecksum(changes), whole);
}

}  // namespace
}  // namespace kairos
