#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "io/input_series.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::HasSubstr;

template <class T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

template <class T>
std::unique_ptr<InputSeries> openOne(const test::TemporaryDirectory& directory, const std::vector<T>& values,
                                     Vec3i dims) {
  return InputSeries::open({directory.write("s_0005.raw", bytesOf(values))},
                           {"", RawFormat{dims, elementTypeOf<T>(), {0.5, 1, 2}}});
}

TEST(RawSeries, ReadsU8XFastestAtVoxelSize) {
  const test::TemporaryDirectory directory;
  const auto series = openOne<uint8_t>(directory, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, {3, 2, 2});
  EXPECT_EQ(series->steps()[0].step, 5);
  EXPECT_EQ(series->bytes(0), 12u);
  const Lattice& lattice = series->lattice();
  EXPECT_TRUE(lattice.dense);
  EXPECT_EQ(lattice.type, ElementType::u8);
  EXPECT_EQ(lattice.domain, (VoxelBox{{0, 0, 0}, {3, 2, 2}}));
  EXPECT_EQ(lattice.worldFromIndex.point({1, 1, 1}), (Vec3d{0.5, 1, 2}));
  const Field field = series->read(0);
  EXPECT_EQ(field.value({2, 0, 0}), 3);
  EXPECT_EQ(field.value({0, 1, 0}), 4);
  EXPECT_EQ(field.value({1, 0, 1}), 8);
}

TEST(RawSeries, ReadsU16AndFloatsWithNaN) {
  const test::TemporaryDirectory directory;
  EXPECT_EQ(openOne<uint16_t>(directory, {1, 65535}, {2, 1, 1})->read(0).value({1, 0, 0}), 65535);
  const Field field = openOne<float>(directory, {-1.5f, std::nanf("1")}, {1, 1, 2})->read(0);
  EXPECT_EQ(field.value({0, 0, 0}), -1.5);
  EXPECT_TRUE(std::isnan(field.value({0, 0, 1})));
}

TEST(RawSeries, AWrongSizeNamesBothNumbers) {
  const test::TemporaryDirectory directory;
  const std::string message = test::messageOf<InputError>([&] {
    openOne<uint16_t>(directory, {1, 2, 3}, {2, 2, 1});
  });
  EXPECT_THAT(message, HasSubstr("s_0005.raw"));
  EXPECT_THAT(message, HasSubstr("6 bytes"));
  EXPECT_THAT(message, HasSubstr("expected 8"));
}

TEST(RawSeries, NoticesAFileThatShrinksAfterOpening) {
  const test::TemporaryDirectory directory;
  const auto series = openOne<uint8_t>(directory, {1, 2, 3, 4}, {2, 2, 1});
  directory.write("s_0005.raw", "12");
  EXPECT_THROW(series->read(0), InputError);
}

TEST(RawSeries, DimensionsAreRequiredAndChecked) {
  const test::TemporaryDirectory directory;
  const std::string path = directory.write("s_1.raw", "1234");
  const auto open = [&](Vec3i dims, Vec3d voxel) {
    return test::messageOf<OptionError>([&] {
      InputSeries::open({path}, {"", RawFormat{dims, ElementType::u8, voxel}});
    });
  };
  EXPECT_THAT(test::messageOf<OptionError>([&] { InputSeries::open({path}, {}); }),
              HasSubstr("--dims: required"));
  EXPECT_THAT(open({0, 2, 2}, {1, 1, 1}), HasSubstr("--dims"));
  EXPECT_THAT(open({2147483647, 2147483647, 2147483647}, {1, 1, 1}), HasSubstr("--dims"));
  EXPECT_THAT(open({2, 2, 1}, {1, 0, 1}), HasSubstr("--voxel-size"));
  EXPECT_THAT(open({2, 2, 1}, {1, NAN, 1}), HasSubstr("--voxel-size"));
  EXPECT_THROW(InputSeries::open({path}, {"density", RawFormat{{2, 2, 1}, ElementType::u8, {1, 1, 1}}}),
               OptionError);
}

}  // namespace
}  // namespace kairos
