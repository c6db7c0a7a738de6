// The element types a volume keeps natively, and arrays of them.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace kairos {

enum class ElementType : uint8_t { u8, u16, f32 };

constexpr std::string_view name(ElementType t) {
  return t == ElementType::u8 ? "u8" : t == ElementType::u16 ? "u16" : "f32";
}
constexpr int bytesPerVoxel(ElementType t) {
  return t == ElementType::u8 ? 1 : t == ElementType::u16 ? 2 : 4;
}

template <class T>
constexpr ElementType elementTypeOf() {
  static_assert(std::is_same_v<T, uint8_t> || std::is_same_v<T, uint16_t> || std::is_same_v<T, float>);
  return std::is_same_v<T, uint8_t>    ? ElementType::u8
         : std::is_same_v<T, uint16_t> ? ElementType::u16
                                       : ElementType::f32;
}

/// Voxel values of one element type. The alternative's index is the ElementType's value.
using VoxelArray = std::variant<std::vector<uint8_t>, std::vector<uint16_t>, std::vector<float>>;

inline ElementType elementType(const VoxelArray& a) {
  return ElementType(a.index());
}
inline VoxelArray makeVoxelArray(ElementType t) {
  if (t == ElementType::u8) return std::vector<uint8_t>{};
  if (t == ElementType::u16) return std::vector<uint16_t>{};
  return std::vector<float>{};
}
template <class T>
std::vector<T>& valuesAs(VoxelArray& a) {
  return std::get<std::vector<T>>(a);
}
template <class T>
const std::vector<T>& valuesAs(const VoxelArray& a) {
  return std::get<std::vector<T>>(a);
}
inline size_t size(const VoxelArray& a) {
  return std::visit([](const auto& v) { return v.size(); }, a);
}

/// Calls f.template operator()<T>() with the C++ type of `t`.
template <class F>
decltype(auto) dispatch(ElementType t, F&& f) {
  switch (t) {
    case ElementType::u8:
      return f.template operator()<uint8_t>();
    case ElementType::u16:
      return f.template operator()<uint16_t>();
    default:
      return f.template operator()<float>();
  }
}

template <class T>
constexpr bool isFiniteValue(T v) {
  if constexpr (std::is_floating_point_v<T>) return std::isfinite(v);
  return true;
}

/// A value's bits, zero-extended: what "changed" and the checksums compare.
template <class T>
constexpr uint64_t bitsOf(T value) {
  if constexpr (std::is_same_v<T, float>)
    return std::bit_cast<uint32_t>(value);
  else
    return value;
}

}  // namespace kairos
