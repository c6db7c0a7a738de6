// A field at several resolutions, each on the same lattice of points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

/// Blocks of 8^3 vertices in which a pyramid's values changed, level by level, each listed once in ascending
/// order (lessZYX).
inline constexpr int kDirtyBlockEdge = 8;
struct DirtyBlocks {
  std::vector<std::vector<Vec3i>> levels;
  uint64_t verticesComputed = 0;  // coarse values computed anew to find out
};

/// Level 0 holds the voxels inside Lattice::samplingBox(), as floats; NaN and infinities are the background.
/// Vertex v of level l stands on vertex 2^l v of level 0, so coarse vertices lie on fine ones: subvolumes of
/// different level can share the values on their common face, and a feature does not move with the level.
/// A coarse value is the mean of the 2x2x2 cells around its vertex, a cell being the mean of its 2x2x2
/// vertices (Li and Shen 2002, 3.1: "average every 2x2x2 voxels", centred). At the ends the field is
/// mirrored, which keeps the mean of cells exact; an odd last cell is completed by its outermost value.
class ScalarPyramid {
 public:
  ScalarPyramid(const Lattice& lattice, const Field& field, int levels, ThreadPool& pool);
  /// With the coarse levels taken from an earlier run (see coarseValues) instead of being computed. Throws
  /// StateError when their number does not fit.
  ScalarPyramid(const Lattice& lattice, const Field& field, int levels, std::span<const float> coarse);

  int levels() const { return int(values_.size()); }
  /// Voxel index of vertex (0, 0, 0).
  Vec3i origin() const { return origin_; }
  Vec3i vertices(int level) const { return sizes_[size_t(level)]; }
  /// Cells of level 0 along each axis: one less than vertices.
  Vec3i cells() const { return sizes_[0] - Vec3i{1, 1, 1}; }
  /// x fastest.
  const std::vector<float>& values(int level) const { return values_[size_t(level)]; }
  float value(int level, const Vec3i& v) const { return values_[size_t(level)][index(level, v)]; }
  /// All levels but the first, one after the other.
  std::vector<float> coarseValues() const;

  /// Writes the changed voxels and computes the coarse values that depend on them, and no others. Throws
  /// StateError for another element type or a voxel outside the domain; nothing has changed then. The result
  /// is valid until the next call.
  const DirtyBlocks& apply(const ChangedVoxels& changes);

 private:
  void allocate(int levels);
  void fill(const Field& field);
  size_t index(int level, const Vec3i& v) const {
    const Vec3i& n = sizes_[size_t(level)];
    return (size_t(v.z) * size_t(n.y) + size_t(v.y)) * size_t(n.x) + size_t(v.x);
  }
  float& at(int level, const Vec3i& v) { return values_[size_t(level)][index(level, v)]; }
  float restricted(int level, const Vec3i& v) const;
  void check(const ChangedVoxels& changes) const;
  template <class T>
  void write(const ChangedVoxels& changes);
  void markDirty(int level, const Vec3i& vertex);
  void updateLevel(int level);

  Lattice lattice_;
  float background_;
  Vec3i origin_;
  std::vector<Vec3i> sizes_;
  std::vector<std::vector<float>> values_;
  std::vector<Vec3i> copies_;  // where else a voxel's value stands: around an axis of a single voxel
  std::vector<std::vector<char>> marked_;
  DirtyBlocks dirty_;
};

/// As many levels as it takes to bring `cells` down to `minimumCells` along their longest axis; at least 1.
int pyramidLevels(int cells, int minimumCells);

}  // namespace kairos
