// The complete octree over a volume that says how much the values vary inside each node.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/box.h"
#include "core/parallel.h"
#include "lod/scalar_pyramid.h"

namespace kairos {

/// Of the values inside one node.
struct NodeStatistics {
  int64_t count = 0;
  double mean = 0;
  double squares = 0;                         // sum of (value - mean)^2
  std::array<double, 2> squaresWithin{0, 0};  // the same within blocks of 2^3 and of 4^3 values

  bool operator==(const NodeStatistics&) const = default;
  /// Standard deviation.
  double deviation() const;
  /// Adds what another node holds (Chan, Golub and LeVeque 1983).
  void merge(const NodeStatistics& other);
};

/// Nodes of height h cover (8 << h)^3 vertices of a pyramid's level 0, clipped to the volume; the root covers
/// all. Li and Shen 2002, 3.1, after Laur and Hanrahan 1991.
class ValueOctree {
 public:
  static constexpr int kLeafEdge = kDirtyBlockEdge;

  ValueOctree(const ScalarPyramid& pyramid, ThreadPool& pool);
  /// From `all()` of an equal volume. Throws StateError when the number of nodes does not fit.
  ValueOctree(const ScalarPyramid& pyramid, std::span<const NodeStatistics> stored);

  /// Height of the root.
  int height() const { return int(levels_.size()) - 1; }
  static int edge(int height) { return kLeafEdge << height; }
  /// Nodes along each axis at this height.
  Vec3i nodes(int height) const { return sizes_[size_t(height)]; }
  const NodeStatistics& node(int height, const Vec3i& node) const;
  /// All nodes, leaves first.
  std::vector<NodeStatistics> all() const;

  /// Root mean square of what is lost inside `box` when every 2^level-th value along each axis has to stand
  /// for its neighbourhood: the deviation within blocks of 2^level values. `box` is aligned to multiples of
  /// max(8, 2^level) or ends with the volume.
  double deviationWithin(const VoxelBox& box, int level) const;

  /// Brings the nodes over these leaves up to date.
  void update(const ScalarPyramid& pyramid, std::span<const Vec3i> leaves);

 private:
  void allocate(const Vec3i& vertices);
  NodeStatistics& at(int height, const Vec3i& node);
  void measureLeaf(const ScalarPyramid& pyramid, const Vec3i& leaf);
  void mergeChildren(int height, const Vec3i& node);

  std::vector<Vec3i> sizes_;
  std::vector<std::vector<NodeStatistics>> levels_;
};

}  // namespace kairos
