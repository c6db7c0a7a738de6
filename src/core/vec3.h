// Three-component vectors and voxel coordinates.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>

namespace kairos {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  constexpr T& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr const T& operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr bool operator==(const Vec3&) const = default;

  constexpr Vec3 operator+(const Vec3& b) const { return {T(x + b.x), T(y + b.y), T(z + b.z)}; }
  constexpr Vec3 operator-(const Vec3& b) const { return {T(x - b.x), T(y - b.y), T(z - b.z)}; }
  constexpr Vec3 operator*(T s) const { return {T(x * s), T(y * s), T(z * s)}; }
  constexpr Vec3 operator-() const { return {T(-x), T(-y), T(-z)}; }

  template <class U>
  constexpr explicit operator Vec3<U>() const {
    return {U(x), U(y), U(z)};
  }
};

using Vec3i = Vec3<int32_t>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <class T>
constexpr T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3d& v) {
  return std::sqrt(dot(v, v));
}
inline Vec3d normalized(const Vec3d& v) {
  return v * (1.0 / length(v));
}

template <class T>
constexpr Vec3<T> componentMin(const Vec3<T>& a, const Vec3<T>& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
template <class T>
constexpr Vec3<T> componentMax(const Vec3<T>& a, const Vec3<T>& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// The order in which voxels, leaves and bricks are stored and listed: z slowest, x fastest.
constexpr std::strong_ordering compareZYX(const Vec3i& a, const Vec3i& b) {
  if (auto c = a.z <=> b.z; c != 0) return c;
  if (auto c = a.y <=> b.y; c != 0) return c;
  return a.x <=> b.x;
}
constexpr bool lessZYX(const Vec3i& a, const Vec3i& b) {
  return compareZYX(a, b) < 0;
}

/// Largest multiple of `step` that is <= v, also for negative v.
constexpr int32_t floorToMultiple(int32_t v, int32_t step) {
  const int32_t r = v % step;
  return v - (r < 0 ? r + step : r);
}

}  // namespace kairos
