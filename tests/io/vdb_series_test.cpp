#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <bit>
#include <cmath>
#include <fstream>

#include "core/error.h"
#include "io/input_series.h"
#include "io/temporary_directory.h"
#include "io/vdb_files.h"

namespace kairos {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using test::blobGrid;
using test::writeVdb;
using testing::HasSubstr;

class VdbSeries : public testing::Test {
 protected:
  std::string path(int step) const {
    return directory_ / ("s_" + std::to_string(1000 + step).substr(1) + ".vdb");
  }
  void write(int step, const openvdb::GridPtrVec& grids) { writeVdb(path(step), grids); }
  std::unique_ptr<InputSeries> open(const std::string& grid = "") {
    return InputSeries::open({directory_.path()}, {grid, {}});
  }
  std::string problem(const std::string& grid = "") {
    return test::messageOf<InputError>([&] {
      const auto series = open(grid);
      for (size_t i = 0; i < series->steps().size(); ++i) series->read(i);
    });
  }
  test::TemporaryDirectory directory_;
};

// Every voxel of `box` has the value that OpenVDB's own accessor finds.
template <class GridT>
void expectSame(const Field& field, const GridT& grid, const CoordBBox& box) {
  auto accessor = grid.getConstAccessor();
  for (auto it = box.begin(); it; ++it) {
    const Coord c = *it;
    ASSERT_EQ(field.value({c.x(), c.y(), c.z()}), double(float(accessor.getValue(c)))) << c;
  }
}

Vec3d worldOf(const openvdb::GridBase& grid, const Vec3d& p) {
  const auto w = grid.indexToWorld(openvdb::Vec3d(p.x, p.y, p.z));
  return {w.x(), w.y(), w.z()};
}

TEST_F(VdbSeries, ValuesAreThoseOfTheGridAtNegativeIndicesToo) {
  const auto grid = blobGrid(Coord(-5, 3, -70), 12);
  write(21, {grid});
  const auto series = open();
  EXPECT_EQ(series->steps()[0].step, 21);
  EXPECT_EQ(series->gridName(), "density");
  const CoordBBox box = grid->evalActiveVoxelBoundingBox();
  EXPECT_EQ(series->lattice().domain, (VoxelBox{{box.min().x(), box.min().y(), box.min().z()},
                                                {box.max().x() + 1, box.max().y() + 1, box.max().z() + 1}}));
  const Field field = series->read(0);
  expectSame(field, *grid, CoordBBox(Coord(-20, -12, -85), Coord(10, 18, -55)));
  EXPECT_TRUE(series->lattice().domain.contains(field.bounds));
  EXPECT_FALSE(series->lattice().dense);
  EXPECT_TRUE(std::is_sorted(field.leafOrigins.begin(), field.leafOrigins.end(), lessZYX));
  EXPECT_GT(series->bytes(0), 0u);
}

TEST_F(VdbSeries, EveryCompressionAndHalfGivesTheSameValues) {
  using namespace openvdb::io;
  const auto grid = blobGrid(Coord(4, 4, 4), 9);
  const CoordBBox box(Coord(-8), Coord(16));
  for (int compression : {int(COMPRESS_NONE), int(COMPRESS_ZIP), int(COMPRESS_ACTIVE_MASK),
                          COMPRESS_ZIP | COMPRESS_ACTIVE_MASK, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK}) {
    writeVdb(path(1), {grid}, uint32_t(compression));
    expectSame(open()->read(0), *grid, box);
  }
  grid->setSaveFloatAsHalf(true);
  write(1, {grid});
  const Field field = open()->read(0);
  auto accessor = grid->getConstAccessor();
  for (auto it = box.begin(); it; ++it) {
    const float v = accessor.getValue(*it);
    ASSERT_EQ(float(field.value({(*it).x(), (*it).y(), (*it).z()})), float(openvdb::math::half(v)));
  }
}

TEST_F(VdbSeries, EveryScalarTypeIsRead) {
  auto doubles = openvdb::DoubleGrid::create(0.25);
  doubles->tree().setValueOn(Coord(1, 2, 3), 1e-3);
  auto ints = openvdb::Int32Grid::create(-3);
  ints->tree().setValueOn(Coord(1, 2, 3), 77);
  auto longs = openvdb::Int64Grid::create(0);
  longs->tree().setValueOn(Coord(1, 2, 3), 1 << 20);
  auto bools = openvdb::BoolGrid::create(false);
  bools->tree().setValueOn(Coord(1, 2, 3), true);
  bools->tree().setValueOn(Coord(1, 2, 4), false);
  auto mask = openvdb::MaskGrid::create();
  mask->tree().setValueOn(Coord(1, 2, 3));
  const openvdb::GridPtrVec grids{doubles, ints, longs, bools, mask};
  const char* const names[] = {"d", "i", "l", "b", "m"};
  for (size_t i = 0; i < grids.size(); ++i) grids[i]->setName(names[i]);
  write(1, grids);
  const double values[] = {double(1e-3f), 77, 1 << 20, 1, 1}, backgrounds[] = {0.25, -3, 0, 0, 0};
  for (size_t i = 0; i < grids.size(); ++i) {
    const auto series = open(names[i]);
    EXPECT_EQ(series->lattice().type, i < 3 ? ElementType::f32 : ElementType::u8) << names[i];
    EXPECT_EQ(series->lattice().background, backgrounds[i]) << names[i];
    EXPECT_EQ(series->read(0).value({1, 2, 3}), values[i]) << names[i];
    EXPECT_EQ(series->read(0).value({1, 2, 4}), backgrounds[i]) << names[i];
  }
}

TEST_F(VdbSeries, ActiveTilesOfEveryLevelAreExpanded) {
  auto grid = FloatGrid::create(0);
  grid->setName("density");
  grid->tree().addTile(1, Coord(8, 0, 0), 2, true);    // one leaf
  grid->tree().addTile(2, Coord(128, 0, 0), 3, true);  // 16^3 leaves
  write(1, {grid});
  const Field field = open()->read(0);
  EXPECT_EQ(field.leafCount(), 1u + 4096u);
  EXPECT_EQ(field.value({8, 0, 0}), 2);
  EXPECT_EQ(field.value({7, 0, 0}), 0);
  EXPECT_EQ(field.value({128 + 127, 127, 127}), 3);
  EXPECT_EQ(field.bounds, (VoxelBox{{8, 0, 0}, {256, 128, 128}}));
}

TEST_F(VdbSeries, InactiveValuesCountWithinTheActiveBounds) {
  const auto grid = openvdb::tools::createLevelSetSphere<FloatGrid>(30, openvdb::Vec3f(3, 0, -2), 1, 3);
  grid->setName("surface");
  write(1, {grid});
  const auto series = open();
  EXPECT_EQ(series->lattice().background, 3);
  expectSame(series->read(0), *grid, CoordBBox(Coord(-34, -36, -38), Coord(40, 36, 34)));
  EXPECT_EQ(series->read(0).value({3, 0, -2}), -3);
}

TEST_F(VdbSeries, InactiveValuesOutsideTheStatedBoundsAreRefused) {
  const auto grid = blobGrid(Coord(4, 4, 4), 3);
  grid->tree().setValueOff(Coord(40, 0, 0), 5);
  write(1, {grid});
  EXPECT_THAT(problem(), HasSubstr("outside the bounding box"));
}

TEST_F(VdbSeries, WithoutStatisticsTheGridItselfIsMeasured) {
  const auto grid = blobGrid(Coord(4, 4, 4), 3);
  grid->tree().setValueOff(Coord(40, 0, 0), 5);
  writeVdb(path(1), {grid}, openvdb::io::COMPRESS_ZIP, false);
  const auto series = open();
  EXPECT_EQ(series->lattice().domain.hi.x, 41);
  EXPECT_EQ(series->read(0).value({40, 0, 0}), 5);
}

TEST_F(VdbSeries, ATileThatWouldFillTheMemoryIsRefused) {
  auto grid = FloatGrid::create(0);
  grid->setName("density");
  grid->tree().addTile(3, Coord(0), 1, true);  // 4096^3 voxels
  write(1, {grid});
  EXPECT_THAT(problem(), HasSubstr("2^26"));
}

TEST_F(VdbSeries, EmptyGridsHaveNoBoundsAndNoLeaves) {
  auto empty = FloatGrid::create(0);
  empty->setName("density");
  write(1, {empty});
  write(2, {blobGrid(Coord(0), 4)});
  write(3, {empty});
  const auto series = open();
  EXPECT_EQ(series->lattice().domain, (VoxelBox{{-3, -3, -3}, {4, 4, 4}}));
  EXPECT_EQ(series->read(0).leafCount(), 0u);
  EXPECT_TRUE(series->read(2).bounds.empty());
}

TEST_F(VdbSeries, TheDomainIsTheUnionOfTheStepsBounds) {
  write(1, {blobGrid(Coord(0), 3)});
  write(2, {blobGrid(Coord(20, 0, 0), 3)});
  EXPECT_EQ(open()->lattice().domain, (VoxelBox{{-2, -2, -2}, {23, 3, 3}}));
}

TEST_F(VdbSeries, AffineTransformsOfEveryKindAreKept) {
  using openvdb::math::Transform;
  const auto affine = Transform::createLinearTransform(openvdb::math::Mat4d(
      0.5, 0.1, 0.0, 0.0, -0.2, 0.4, 0.0, 0.0, 0.0, 0.3, 2.0, 0.0, 10.0, -20.0, 30.0, 1.0));
  const auto uniform = Transform::createLinearTransform(0.25);
  auto anisotropic = Transform::createLinearTransform(1.0);
  anisotropic->preScale(openvdb::Vec3d(1, 2, 3));
  auto moved = anisotropic->copy();
  moved->postTranslate(openvdb::Vec3d(5, 6, 7));
  auto shifted = Transform::createLinearTransform(1.0);
  shifted->postTranslate(openvdb::Vec3d(5, 6, 7));
  auto uniformMoved = uniform->copy();
  uniformMoved->postTranslate(openvdb::Vec3d(-1, 0, 1));
  auto rotated = uniform->copy();
  rotated->preRotate(0.3, openvdb::math::Y_AXIS);
  for (const auto& transform : {affine, uniform, anisotropic, moved, shifted, uniformMoved, rotated}) {
    const auto grid = blobGrid(Coord(0), 3);
    grid->setTransform(transform);
    write(1, {grid});
    const Affine found = open()->lattice().worldFromIndex;
    for (const Vec3d p : {Vec3d{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {3, -4, 5}})
      EXPECT_LT(length(found.point(p) - worldOf(*grid, p)), 1e-12) << transform->mapType();
  }
}

TEST_F(VdbSeries, FrustumTransformsAreRefused) {
  const auto grid = blobGrid(Coord(0), 3);
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(100)), 0.5, 10));
  write(1, {grid});
  EXPECT_THAT(problem(), HasSubstr("NonlinearFrustumMap"));
}

TEST_F(VdbSeries, ANonZeroBackgroundIsNotStored) {
  auto grid = FloatGrid::create(-1.5f);
  grid->setName("density");
  grid->tree().setValueOn(Coord(0), 0);
  grid->tree().setValueOn(Coord(64, 0, 0), -1.5f);  // active, and yet background
  write(1, {grid});
  const Field field = open()->read(0);
  EXPECT_EQ(field.background, -1.5);
  EXPECT_EQ(field.leafCount(), 1u);
  EXPECT_EQ(field.value({0, 0, 0}), 0);
  EXPECT_EQ(field.value({1, 0, 0}), -1.5);
}

TEST_F(VdbSeries, NaNAndInfinityKeepTheirBits) {
  const float payload = std::bit_cast<float>(0x7fc12345u);
  const auto grid = blobGrid(Coord(0), 3);
  grid->tree().setValueOn(Coord(1, 0, 0), payload);
  grid->tree().setValueOn(Coord(0, 1, 0), -std::numeric_limits<float>::infinity());
  write(1, {grid});
  const Field field = open()->read(0);
  const auto leaf = size_t(field.findLeaf({0, 0, 0}));
  EXPECT_EQ(std::bit_cast<uint32_t>(valuesAs<float>(field.values)[leaf * kLeafVoxels + 1]), 0x7fc12345u);
  EXPECT_EQ(field.value({0, 1, 0}), -std::numeric_limits<double>::infinity());
}

TEST_F(VdbSeries, InstancesShareTheTreeOfAnotherGrid) {
  const auto grid = blobGrid(Coord(0), 3);
  const auto copy = openvdb::GridBase::Ptr(grid->copyGrid());
  copy->setName("again");
  copy->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  write(1, {grid, copy});
  const auto series = open("again");
  EXPECT_EQ(series->lattice().worldFromIndex.voxelSize(), 0.5);
  expectSame(series->read(0), *grid, CoordBBox(Coord(-4), Coord(4)));
}

TEST_F(VdbSeries, FilesWrittenAsAStreamAreRead) {
  const auto grid = blobGrid(Coord(0), 5);
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("velocity");
  velocity->tree().setValueOn(Coord(3), openvdb::Vec3s(1, 2, 3));
  {
    std::ofstream out(path(1), std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridPtrVec{velocity, grid});
  }
  expectSame(open()->read(0), *grid, CoordBBox(Coord(-6), Coord(6)));
}

// The grids of a Mantaflow file: a constant made of tiles, an empty one, a vector field.
openvdb::GridPtrVec mantaflowGrids(const std::string& nameOfDensity) {
  const auto density = blobGrid(Coord(8), 6), temperature = blobGrid(Coord(8), 6, 300);
  density->setName(nameOfDensity);
  temperature->setName("temperature");
  auto shadow = FloatGrid::create(0), flame = FloatGrid::create(0);
  shadow->setName("shadow");
  shadow->tree().addTile(1, Coord(0), -1, true);
  shadow->tree().addTile(1, Coord(8, 0, 0), -1, true);
  flame->setName("flame");
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("velocity");
  return {velocity, shadow, flame, density, temperature};
}

TEST_F(VdbSeries, DensityIsTheDefaultAmongSeveral) {
  write(1, mantaflowGrids("density"));
  EXPECT_EQ(open()->gridName(), "density");
}

TEST_F(VdbSeries, OtherwiseTheOnlyGridWithSomethingInIt) {
  openvdb::GridPtrVec grids = mantaflowGrids("smoke");
  grids.pop_back();
  auto empty = FloatGrid::create(0);
  empty->setName("smoke");
  write(1, {grids[0], grids[1], grids[2], empty});
  write(2, grids);
  EXPECT_EQ(open()->gridName(), "smoke");
}

TEST_F(VdbSeries, SeveralCandidatesAreListedWithTheirTypes) {
  write(1, mantaflowGrids("smoke"));
  const std::string message = problem();
  EXPECT_THAT(message, HasSubstr("smoke (float), temperature (float)"));
  EXPECT_THAT(message, HasSubstr("--grid"));
  EXPECT_THAT(message, testing::Not(HasSubstr("shadow")));
}

TEST_F(VdbSeries, UnsuitableGridsAreNamedWithWhatThereIs) {
  write(1, mantaflowGrids("density"));
  EXPECT_THAT(problem("velocity"), HasSubstr("vec3s"));
  EXPECT_THAT(problem("none"), HasSubstr("it holds velocity (vec3s), shadow (float)"));
}

TEST_F(VdbSeries, GridsOfOneNameAreToldApartByNumber) {
  const auto a = blobGrid(Coord(0), 3), b = blobGrid(Coord(0), 5);
  write(1, {a, b});
  EXPECT_THAT(problem("density"), HasSubstr("several grids called"));
  expectSame(open("density[1]")->read(0), *b, CoordBBox(Coord(-6), Coord(6)));
}

TEST_F(VdbSeries, StepsThatDoNotFitNameTheStepAndTheDifference) {
  const auto grid = blobGrid(Coord(0), 3);
  write(21, {grid});
  const auto other = blobGrid(Coord(0), 3);
  other->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  write(22, {other});
  EXPECT_THAT(problem(),
              HasSubstr("s_022.vdb: step 22 has voxel size (0.5, 0.5, 0.5) where step 21 has (1, 1, 1)"));

  other->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  other->transform().postTranslate(openvdb::Vec3d(0, 0, 2));
  write(22, {other});
  EXPECT_THAT(problem(), HasSubstr("origin at (0, 0, 2) where step 21 has (0, 0, 0)"));

  auto background = FloatGrid::create(1);
  background->setName("density");
  write(22, {background});
  EXPECT_THAT(problem(), HasSubstr("step 22 has background 1 where step 21 has 0"));

  auto doubles = openvdb::DoubleGrid::create(0);
  doubles->setName("density");
  write(22, {doubles});
  EXPECT_THAT(problem(), HasSubstr("grid type double where step 21 has float"));
}

TEST_F(VdbSeries, ATransformRecomputedToTheLastBitsIsTheSame) {
  write(1, {blobGrid(Coord(0), 3)});
  const auto grid = blobGrid(Coord(0), 3);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0 + 1e-12));
  write(2, {grid});
  EXPECT_EQ(open()->steps().size(), 2u);
}

TEST_F(VdbSeries, WhatIsNoVdbFileIsSaidToBeNone) {
  directory_.write("s_001.vdb", "this is a text");
  EXPECT_THAT(problem(), HasSubstr("is not an OpenVDB file"));
  directory_.write("s_001.vdb", "");
  EXPECT_THAT(problem(), HasSubstr("is not an OpenVDB file"));
  EXPECT_THROW(InputSeries::open({path(1)}, {"", RawFormat{{1, 1, 1}, ElementType::u8, {1, 1, 1}}}),
               OptionError);
}

TEST_F(VdbSeries, AFileReplacedAfterOpeningIsNoticed) {
  write(1, {blobGrid(Coord(0), 3)});
  const auto series = open();
  const auto grid = blobGrid(Coord(0), 3);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
  write(1, {grid});
  EXPECT_THROW(series->read(0), InputError);
}

}  // namespace
}  // namespace kairos
