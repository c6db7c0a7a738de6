// One time step of a simulation, independent of any file format: the sparse scalar field that files are read
// into, that steps are compared with, and that the render-side volume is built from.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/affine.h"
#include "core/box.h"
#include "core/element_type.h"

namespace kairos {

/// A leaf is 8^3 voxels whose origin is a multiple of 8; voxel (x, y, z) of it has offset x + 8 y + 64 z.
inline constexpr int kLeafEdge = 8;
inline constexpr int kLeafVoxels = 512;
constexpr int leafOffset(int x, int y, int z) {
  return x + 8 * y + 64 * z;
}
constexpr Vec3i leafOriginOf(const Vec3i& v) {
  return {floorToMultiple(v.x, kLeafEdge), floorToMultiple(v.y, kLeafEdge), floorToMultiple(v.z, kLeafEdge)};
}

/// A scalar field on the integer lattice: `background` everywhere except in the stored leaves.
/// Leaves are sorted (lessZYX) and unique; leaf i owns values [512 i, 512 i + 512) of `values`.
/// Values are exact copies of the simulation's, NaN and infinities included.
struct Field {
  double background = 0;  // exactly representable in the element type
  VoxelBox bounds;        // voxels that may differ from the background
  std::vector<Vec3i> leafOrigins;
  VoxelArray values;

  ElementType type() const { return elementType(values); }
  size_t leafCount() const { return leafOrigins.size(); }
  /// Index of the leaf at `origin`, or -1.
  int64_t findLeaf(const Vec3i& origin) const;
  /// The value at voxel `v` as a double; O(log leaves). For tests and tools, not for rendering.
  double value(const Vec3i& v) const;
};

/// Where the lattice stands and how far it extends: what all time steps of a sequence share.
struct Lattice {
  ElementType type = ElementType::u8;
  double background = 0;
  Affine worldFromIndex;
  /// Voxels that any step may hold away from the background.
  VoxelBox domain;
  /// Dense data (raw files, arrays): the field ends at the outermost voxel centres. Otherwise (VDB): it fades
  /// to the background within one voxel outside the domain.
  bool dense = false;

  /// Whose value a voxel takes: its own; just outside dense data, that of the nearest one inside, so that
  /// neither a sample nor a gradient at a face sees an edge that the data do not have.
  Vec3i sourceOf(const Vec3i& voxel) const;
  /// The box in index space outside which nothing is sampled.
  PointBox samplingBox() const;
  /// World-space bounds of samplingBox().
  PointBox worldBounds() const;
};

/// Builds a field from a dense array, x fastest; `origin` is the index of its first voxel.
/// `bounds` becomes the whole array; leaves that hold only `background` are not stored.
template <class T>
Field fieldFromDense(const T* values, const Vec3i& dims, T background = T(0), const Vec3i& origin = {});

/// Order-independent 64-bit checksum of a field's state: the sum over all voxels that differ bitwise from the
/// background of a mix of position and value bits. Voxels changed from `a` to `b` change it by
/// voxelChecksum(v, b) - voxelChecksum(v, a), so it is kept up to date for the price of the changes.
uint64_t stateChecksum(const Field& field);

/// One voxel's term; `valueBits` are the value's bits, zero-extended. 0 when they equal the background's
/// bits.
uint64_t voxelChecksum(const Vec3i& voxel, uint64_t valueBits, uint64_t backgroundBits);

/// Smallest and largest finite value among stored voxels and the background, and how many voxels are NaN or
/// infinite. A background that is not finite counts as the 0 it is rendered as.
struct FieldStatistics {
  double lo, hi;
  int64_t nonFinite;
};
FieldStatistics fieldStatistics(const Field& field);

}  // namespace kairos
