// What Kairos writes, read by OpenVDB itself.
#include "io/vdb_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <limits>

#include "io/temporary_directory.h"
#include "volume/field.h"

namespace kairos {
namespace {

class VdbWriter : public testing::Test {
 protected:
  VdbWriter() {
    openvdb::initialize();
    lattice_.type = ElementType::f32;
    lattice_.worldFromIndex = Affine::scale({0.5, 0.5, 0.5});
  }

  openvdb::FloatGrid::Ptr readByOpenVdb(const std::string& bytes) {
    openvdb::io::File file(directory_.write("f.vdb", bytes));
    file.open();
    EXPECT_EQ(file.getGrids()->size(), 1u);
    return openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  }

  // Leaves on both sides of the origin, in several nodes of every level; voxels that are the background, too.
  template <class T>
  static Field scattered(T background, T (*valueAt)(const Vec3i&)) {
    Field field;
    field.background = double(background);
    std::vector<T> values;
    for (int z : {-4096, -8, 0, 8, 120, 128, 5000 / 8 * 8})
      for (int y : {-16, 0, 4096})
        for (int x : {-4104, -8, 0, 8, 128}) {
          const Vec3i origin{x, y, z};
          field.leafOrigins.push_back(origin);
          for (int i = 0; i < kLeafVoxels; ++i) {
            const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
            values.push_back(i % 5 == 0 ? background : valueAt(v));
          }
        }
    field.values = std::move(values);
    return field;
  }

  template <class T>
  static void expectSame(const Field& field, const openvdb::FloatGrid& grid) {
    const auto& values = std::get<std::vector<T>>(field.values);
    const T background = T(field.background);
    size_t active = 0;
    for (size_t l = 0; l < field.leafCount(); ++l)
      for (int i = 0; i < kLeafVoxels; ++i) {
        const Vec3i v = field.leafOrigins[l] + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
        const T value = values[l * kLeafVoxels + size_t(i)];
        float found;
        const bool on = grid.tree().probeValue({v.x, v.y, v.z}, found);
        ASSERT_EQ(bitsOf(found), bitsOf(float(value)));
        ASSERT_EQ(on, bitsOf(value) != bitsOf(background));
        active += on;
      }
    EXPECT_EQ(grid.activeVoxelCount(), active);
    EXPECT_EQ(grid.background(), float(background));
  }

  test::TemporaryDirectory directory_;
  Lattice lattice_;
};

float noise(const Vec3i& v) {
  return std::sin(float(v.x * 12 + v.y * 7 + v.z)) + (v.x == 0 ? std::numeric_limits<float>::infinity() : 0);
}
float eighths(const Vec3i& v) {
  return float((v.x + v.y + v.z) & 1023) / 8;
}
uint8_t bytes(const Vec3i& v) {
  return uint8_t(v.x + 3 * v.y + 5 * v.z);
}

TEST_F(VdbWriter, OpenVdbReadsEveryVoxel) {
  lattice_.background = 0.1f;
  const Field field = scattered<float>(0.1f, noise);
  const auto grid = readByOpenVdb(vdbFromField(field, lattice_, "density", {}));
  EXPECT_FALSE(grid->saveFloatAsHalf());
  expectSame<float>(field, *grid);
}

TEST_F(VdbWriter, ValuesThatHalvesHoldAreStoredAsHalves) {
  const Field field = scattered<float>(0, eighths);
  const std::string halves = vdbFromField(field, lattice_, "density", {});
  const auto grid = readByOpenVdb(halves);
  EXPECT_TRUE(grid->saveFloatAsHalf());
  expectSame<float>(field, *grid);
  EXPECT_LT(halves.size(), vdbFromField(scattered<float>(0, noise), lattice_, "density", {}).size());
}

TEST_F(VdbWriter, BytesAreFloats) {
  lattice_.type = ElementType::u8;
  const Field field = scattered<uint8_t>(0, bytes);
  expectSame<uint8_t>(field, *readByOpenVdb(vdbFromField(field, lattice_, "density", {})));
}

TEST_F(VdbWriter, AnEmptyGridIsOne) {
  Field field;
  field.values = std::vector<float>{};
  const auto grid = readByOpenVdb(vdbFromField(field, lattice_, "density", {}));
  EXPECT_TRUE(grid->empty());
  ChangedVoxels none;
  none.values = std::vector<float>{};
  EXPECT_TRUE(readByOpenVdb(vdbFromChanges(none, lattice_, "density", {}))->empty());
}

// The background may be a new value.
TEST_F(VdbWriter, ChangedVoxelsAreTheActiveOnes) {
  ChangedVoxels changes;
  ChangedLeaf leaf{{-8, 8, 16}, {}, 0};
  leaf.mask[0] = 0b101;       // voxels (0, 0, 0) and (2, 0, 0) of the leaf
  leaf.mask[7] = 1ull << 63;  // (7, 7, 7)
  changes.leaves = {leaf};
  changes.values = std::vector<float>{1, 0, -0.3f};
  const auto grid = readByOpenVdb(vdbFromChanges(changes, lattice_, "density", {}));
  EXPECT_EQ(grid->activeVoxelCount(), 3u);
  EXPECT_EQ(grid->tree().getValue({-8, 8, 16}), 1);
  EXPECT_TRUE(grid->tree().isValueOn({-6, 8, 16}));
  EXPECT_EQ(grid->tree().getValue({-1, 15, 23}), -0.3f);
  EXPECT_EQ(grid->evalActiveVoxelBoundingBox(), openvdb::CoordBBox({-8, 8, 16}, {-1, 15, 23}));
}

TEST_F(VdbWriter, TransformsAndMetadataArrive) {
  Affine turned = Affine::scale({1, 2, 3});
  turned.column[0] = {0.6, 0.8, 0};
  turned.translation = {5, -1, 0.25};
  Affine moved = Affine::scale({2, 2, 2});
  moved.translation = {1, 2, 3};
  for (const Affine& transform :
       {Affine::scale({0.1, 0.1, 0.1}), Affine::scale({1, -2, 3}), moved, turned, Affine{}}) {
    lattice_.worldFromIndex = transform;
    const Field field = scattered<float>(0, eighths);
    const auto grid = readByOpenVdb(vdbFromField(
        field, lattice_, "density", {{"kairos_step", int64_t(7)}, {"note", std::string("n")}, {"x", 0.5}}));
    const auto p = grid->indexToWorld(openvdb::Vec3d(3, -4, 5));
    const Vec3d expected = transform.column[0] * 3.0 + transform.column[1] * -4.0 +
                           transform.column[2] * 5.0 + transform.translation;
    EXPECT_NEAR((p - openvdb::Vec3d(expected.x, expected.y, expected.z)).length(), 0, 1e-12);
    EXPECT_EQ(grid->metaValue<int64_t>("kairos_step"), 7);
    EXPECT_EQ(grid->metaValue<std::string>("note"), "n");
    EXPECT_EQ(grid->metaValue<double>("x"), 0.5);
    EXPECT_EQ(grid->metaValue<int64_t>("file_voxel_count"), int64_t(grid->activeVoxelCount()));
    const auto box = grid->evalActiveVoxelBoundingBox();
    EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_min"), box.min().asVec3i());
    EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_max"), box.max().asVec3i());
  }
}

TEST_F(VdbWriter, EqualContentGivesEqualBytes) {
  const Field field = scattered<float>(0, noise);
  const std::string first = vdbFromField(field, lattice_, "density", {});
  EXPECT_EQ(first, vdbFromField(field, lattice_, "density", {}));
  EXPECT_NE(first, vdbFromField(field, lattice_, "other", {}));
}

}  // namespace
}  // namespace kairos
