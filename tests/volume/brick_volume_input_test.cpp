// What a brick volume refuses, and that refusing leaves it as it was.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "support/changes.h"
#include "support/scenes.h"
#include "volume/brick_volume.h"

namespace kairos {
namespace {

std::string stateErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const StateError& e) {
    return e.what();
  }
  return "";
}

std::string positionText(const Vec3i& v) {
  std::string text = "(";
  text += std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
  return text;
}

Field emptyField(ElementType type, double background = 0) {
  Field field;
  field.background = background;
  field.values = makeVoxelArray(type);
  return field;
}

TEST(BrickVolumeInput, NamesAVoxelOutsideTheDomainAndChangesNothing) {
  ThreadPool pool(2);
  const auto scene = test::plume(ElementType::u16);  // its domain ends inside leaves
  BrickVolume volume(scene.lattice, scene.field, pool);
  const BrickVolume untouched(scene.lattice, scene.field, pool);
  const VoxelBox domain = scene.lattice.domain;
  const Vec3i inside = domain.lo + Vec3i{2, 2, 2};
  for (const Vec3i& outside : {Vec3i{domain.lo.x - 1, inside.y, inside.z},
                               Vec3i{domain.hi.x, inside.y, inside.z}, Vec3i{inside.x, inside.y, domain.hi.z},
                               Vec3i{9000, -9000, 0}, Vec3i{inside.x, domain.lo.y - 1, inside.z}}) {
    const std::string message = stateErrorOf([&] {
      volume.apply(test::changesOf(ElementType::u16, {{inside, 77}, {outside, 9}}), pool);
    });
    EXPECT_NE(message.find(positionText(outside)), std::string::npos) << message;
  }
  EXPECT_EQ(volume.allocatedBricks(), untouched.allocatedBricks());
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell)
    EXPECT_EQ(std::memcmp(volume.brick<uint16_t>(cell), untouched.brick<uint16_t>(cell),
                          kBrickVoxels * sizeof(uint16_t)),
              0);
}

TEST(BrickVolumeInput, AcceptsChangesInTheDomainsOutermostVoxels) {
  ThreadPool pool(1);
  const auto scene = test::plume(ElementType::u8);
  BrickVolume volume(scene.lattice, scene.field, pool);
  const VoxelBox domain = scene.lattice.domain;
  EXPECT_NO_THROW(volume.apply(
      test::changesOf(ElementType::u8, {{domain.lo, 1}, {domain.hi - Vec3i{1, 1, 1}, 1}}), pool));
}

TEST(BrickVolumeInput, RefusesAnotherElementTypeAndNamesBoth) {
  ThreadPool pool(1);
  const auto scene = test::plume(ElementType::u16);
  BrickVolume volume(scene.lattice, scene.field, pool);
  for (const std::string& message :
       {stateErrorOf([&] {
          volume.apply(test::changesOf(ElementType::u8, {{{0, 10, 0}, 1}}), pool);
        }),
        stateErrorOf([&] { BrickVolume(scene.lattice, emptyField(ElementType::u8), pool); })}) {
    EXPECT_NE(message.find("u16"), std::string::npos) << message;
    EXPECT_NE(message.find("u8"), std::string::npos) << message;
  }
}

TEST(BrickVolumeInput, RefusesAFieldThatReachesOutOfTheDomain) {
  ThreadPool pool(1);
  auto scene = test::plume(ElementType::u8);
  for (const Vec3i& outside : {Vec3i{scene.lattice.domain.hi.x, 10, 0}, Vec3i{0, 4000, 0}}) {
    Field field = scene.field;
    applyChanges(test::changesOf(ElementType::u8, {{outside, 5}}), field);
    const std::string message = stateErrorOf([&] { BrickVolume(scene.lattice, field, pool); });
    EXPECT_NE(message.find(positionText(outside)), std::string::npos) << message;
  }
}

TEST(BrickVolumeInput, RefusesAFieldWithAnotherBackground) {
  ThreadPool pool(1);
  Lattice lattice = test::sparseLattice(ElementType::f32, {8, 8, 8});
  EXPECT_NE(stateErrorOf([&] { BrickVolume(lattice, emptyField(ElementType::f32, 2), pool); }), "");
  lattice.background = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NO_THROW(BrickVolume(lattice, emptyField(ElementType::f32, lattice.background), pool));
}

TEST(BrickVolumeInput, RefusesADomainOfTooManyBricksWithoutOverflow) {
  ThreadPool pool(1);
  constexpr int kMost = std::numeric_limits<int>::max();
  Lattice lattice;
  for (const VoxelBox& domain : {VoxelBox{{0, 0, 0}, {1 << 20, 1 << 20, 1 << 20}},
                                 VoxelBox{{-kMost - 1, -kMost - 1, -kMost - 1}, {kMost, kMost, kMost}},
                                 VoxelBox{{0, 0, 0}, {kMost, kMost, 1}}}) {
    lattice.domain = domain;
    const std::string message =
        stateErrorOf([&] { BrickVolume(lattice, emptyField(ElementType::u8), pool); });
    EXPECT_NE(message.find("bricks"), std::string::npos) << message;
  }
}

TEST(BrickVolumeInput, CountsVoxelsIn64Bits) {
  const VoxelBox box{{0, 0, 0}, {100000, 100000, 100000}};
  EXPECT_EQ(box.voxelCount(), 1000000000000000);
}

TEST(BrickVolumeInput, AnEmptyFieldInAnEmptyDomainIsOneOrMoreSharedBricks) {
  ThreadPool pool(1);
  const Lattice lattice;
  BrickVolume volume(lattice, emptyField(ElementType::u8), pool);
  EXPECT_EQ(volume.allocatedBricks(), 1u);
  EXPECT_GE(volume.cellCount(), 1u);
  EXPECT_EQ(volume.apply(test::changesOf(ElementType::u8, {}), pool).cells.size(), 0u);
  EXPECT_NE(stateErrorOf([&] {
              volume.apply(test::changesOf(ElementType::u8, {{{0, 0, 0}, 1}}), pool);
            }),
            "");
}

}  // namespace
}  // namespace kairos
