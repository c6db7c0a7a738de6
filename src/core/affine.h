// Affine maps between index space and world space.
#pragma once

#include <array>

#include "core/vec3.h"

namespace kairos {

/// p -> linear * p + translation; `column[a]` is the image of axis a.
struct Affine {
  std::array<Vec3d, 3> column{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  Vec3d translation{};

  bool operator==(const Affine&) const = default;

  static Affine scale(const Vec3d& s) { return {{Vec3d{s.x, 0, 0}, Vec3d{0, s.y, 0}, Vec3d{0, 0, s.z}}, {}}; }

  Vec3d vector(const Vec3d& v) const { return column[0] * v.x + column[1] * v.y + column[2] * v.z; }
  Vec3d point(const Vec3d& p) const { return vector(p) + translation; }
  /// linear^T * v. A gradient in index space becomes one in world space by `inverse().transposedVector(g)`.
  Vec3d transposedVector(const Vec3d& v) const {
    return {dot(column[0], v), dot(column[1], v), dot(column[2], v)};
  }

  double determinant() const { return dot(column[0], cross(column[1], column[2])); }
  /// Throws nothing; a singular map yields infinities, so check `determinant()` where a file provides the
  /// map.
  Affine inverse() const;

  /// Shortest voxel edge in world units: the length that one unit of `--step` stands for.
  double voxelSize() const { return std::min({length(column[0]), length(column[1]), length(column[2])}); }
};

inline Affine Affine::inverse() const {
  const double d = 1.0 / determinant();
  const Vec3d r0 = cross(column[1], column[2]) * d;
  const Vec3d r1 = cross(column[2], column[0]) * d;
  const Vec3d r2 = cross(column[0], column[1]) * d;
  Affine inv;
  inv.column = {Vec3d{r0.x, r1.x, r2.x}, Vec3d{r0.y, r1.y, r2.y}, Vec3d{r0.z, r1.z, r2.z}};
  inv.translation = -inv.vector(translation);
  return inv;
}

}  // namespace kairos
