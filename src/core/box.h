// Axis-aligned boxes: of voxels (half-open) and of points (closed).
#pragma once

#include <cstdint>
#include <limits>

#include "core/vec3.h"

namespace kairos {

/// Voxels lo <= v < hi. Empty when any hi <= lo; the default is empty.
struct VoxelBox {
  Vec3i lo{0, 0, 0}, hi{0, 0, 0};

  bool operator==(const VoxelBox&) const = default;
  bool empty() const { return hi.x <= lo.x || hi.y <= lo.y || hi.z <= lo.z; }
  Vec3i size() const { return empty() ? Vec3i{} : hi - lo; }
  int64_t voxelCount() const {
    const Vec3i s = size();
    return int64_t(s.x) * s.y * s.z;
  }
  bool contains(const Vec3i& v) const {
    return v.x >= lo.x && v.x < hi.x && v.y >= lo.y && v.y < hi.y && v.z >= lo.z && v.z < hi.z;
  }
  bool contains(const VoxelBox& b) const {
    return b.empty() || (componentMin(lo, b.lo) == lo && componentMax(hi, b.hi) == hi);
  }
};

/// The smallest box that holds both; an empty box adds nothing.
inline VoxelBox unite(const VoxelBox& a, const VoxelBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {componentMin(a.lo, b.lo), componentMax(a.hi, b.hi)};
}

/// Points lo <= p <= hi, in index or world space as the name of the variable says.
struct PointBox {
  Vec3d lo{0, 0, 0}, hi{0, 0, 0};
  bool operator==(const PointBox&) const = default;
};

}  // namespace kairos
