// Which subvolumes a volume is rendered in.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/box.h"
#include "lod/value_octree.h"

namespace kairos {

/// When a node of the octree is split (Li and Shen 2002, 3.1).
struct SubdivisionOptions {
  uint64_t memoryLimit = uint64_t(4) << 20;  // bytes that a subvolume's finest texture may take
  double deviationThreshold = 1e300;         // standard deviation beyond which a node is split
  int minimumEdge = 32;                      // cells; nodes are not split below. A power of two, at least 8
  int minimumResolution = 4;                 // cells of the coarsest level of detail along a full edge
  int bytesPerTexel = 4;

  /// Throws OptionError.
  void validate() const;
};

/// A leaf of the subdivision. Positions and cells are counted from the pyramid's vertex (0, 0, 0); it owns
/// the samples with cells.lo <= position < cells.hi, and shares the vertices on its faces with its
/// neighbours.
struct Subvolume {
  VoxelBox cells;
  int edge = 0;    // of the octree's node, before it was clipped to the volume
  int levels = 1;  // resolutions, the first the volume's own

  /// Vertices of one of its levels.
  Vec3i vertices(int level) const {
    const Vec3i n = cells.size();
    const int round = (1 << level) - 1;
    return {((n.x + round) >> level) + 1, ((n.y + round) >> level) + 1, ((n.z + round) >> level) + 1};
  }
  /// Its first vertex, in vertices of the level.
  Vec3i firstVertex(int level) const {
    return {cells.lo.x >> level, cells.lo.y >> level, cells.lo.z >> level};
  }
};

/// The subvolumes, their tree and their neighbours; immutable.
class Subdivision {
 public:
  Subdivision(const ValueOctree& octree, const ScalarPyramid& pyramid, const SubdivisionOptions& options);

  const std::vector<Subvolume>& subvolumes() const { return subvolumes_; }
  size_t size() const { return subvolumes_.size(); }
  /// No subvolume's edge is shorter, before it is clipped to the volume.
  int smallestEdge() const { return blockEdge_; }
  /// The subvolume that owns a cell.
  uint32_t at(const Vec3i& cell) const;
  /// The subvolumes that share a face, an edge or a corner with subvolume i, ascending.
  std::span<const uint32_t> neighbours(uint32_t i) const {
    return std::span(neighbours_).subspan(firstNeighbour_[i], firstNeighbour_[i + 1] - firstNeighbour_[i]);
  }

  /// All subvolumes, such that none is hidden by a later one: seen from `eye`, or, with `parallel`, along the
  /// direction `eye`. Both in the coordinates of cells.
  void frontToBack(const Vec3d& eye, bool parallel, std::vector<uint32_t>& order) const;

 private:
  struct Node {
    Vec3i middle;
    int32_t children[8];     // -1: outside the volume
    int32_t subvolume = -1;  // of a leaf
  };

  int32_t build(const ValueOctree& octree, int height, const Vec3i& node, const SubdivisionOptions& options);
  void visit(int32_t node, const Vec3d& eye, bool parallel, std::vector<uint32_t>& order) const;
  void mapBlocks(int edge);

  Vec3i cells_, blocks_;
  int blockEdge_;
  std::vector<Node> nodes_;
  std::vector<Subvolume> subvolumes_;
  std::vector<uint32_t> blockOwners_;
  std::vector<uint32_t> neighbours_, firstNeighbour_;  // all subvolumes' neighbours after the other
};

}  // namespace kairos
