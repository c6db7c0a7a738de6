#include "core/element_type.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace kairos {
namespace {

TEST(ElementType, VariantIndexNameAndSizeAgreeForEveryType) {
  for (ElementType t : {ElementType::u8, ElementType::u16, ElementType::f32}) {
    EXPECT_EQ(elementType(makeVoxelArray(t)), t);
    dispatch(t, [&]<class T>() {
      EXPECT_EQ(elementTypeOf<T>(), t);
      EXPECT_EQ(int(sizeof(T)), bytesPerVoxel(t));
    });
  }
  EXPECT_EQ(name(ElementType::u8), "u8");
  EXPECT_EQ(name(ElementType::u16), "u16");
  EXPECT_EQ(name(ElementType::f32), "f32");
}

TEST(ElementType, ArraysGiveTheirValuesBack) {
  VoxelArray a = makeVoxelArray(ElementType::u16);
  valuesAs<uint16_t>(a) = {1, 2, 65535};
  EXPECT_EQ(size(a), 3u);
  EXPECT_EQ(valuesAs<uint16_t>(std::as_const(a)).back(), 65535);
  EXPECT_THROW(valuesAs<float>(a), std::bad_variant_access);
}

TEST(ElementType, OnlyFloatsCanBeNotFinite) {
  EXPECT_TRUE(isFiniteValue(uint8_t(255)));
  EXPECT_TRUE(isFiniteValue(1.0f));
  EXPECT_FALSE(isFiniteValue(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_FALSE(isFiniteValue(-std::numeric_limits<float>::infinity()));
}

}  // namespace
}  // namespace kairos
