#include "lod/subdivision.h"

#include <algorithm>
#include <string>

#include "core/error.h"

namespace kairos {
namespace {

bool isPowerOfTwo(int n) {
  return n > 0 && (n & (n - 1)) == 0;
}

bool touch(const VoxelBox& a, const VoxelBox& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.hi[axis] < b.lo[axis] || b.hi[axis] < a.lo[axis]) return false;
  return true;
}

}  // namespace

void SubdivisionOptions::validate() const {
  if (!isPowerOfTwo(minimumEdge) || minimumEdge < ValueOctree::kLeafEdge)
    throw OptionError("subdivision",
                      "found a minimum edge of " + std::to_string(minimumEdge) + ", expected 8, 16, 32, ...");
  if (!isPowerOfTwo(minimumResolution) || minimumResolution > minimumEdge)
    throw OptionError("subdivision", "found a minimum resolution of " + std::to_string(minimumResolution) +
                                         ", expected a power of two up to the minimum edge, " +
                                         std::to_string(minimumEdge));
  if (!(deviationThreshold >= 0))
    throw OptionError("subdivision", "the deviation threshold must be a number of 0 or more");
}

Subdivision::Subdivision(const ValueOctree& octree, const ScalarPyramid& pyramid,
                         const SubdivisionOptions& options)
    : cells_(pyramid.cells()) {
  options.validate();
  build(octree, octree.height(), {0, 0, 0}, options);
  mapBlocks(options.minimumEdge);
  for (uint32_t i = 0; i < size(); ++i) {
    firstNeighbour_.push_back(uint32_t(neighbours_.size()));
    for (uint32_t j = 0; j < size(); ++j)
      if (i != j && touch(subvolumes_[i].cells, subvolumes_[j].cells)) neighbours_.push_back(j);
  }
  firstNeighbour_.push_back(uint32_t(neighbours_.size()));
}

// Returns the node's number, or -1 where it owns no cell.
int32_t Subdivision::build(const ValueOctree& octree, int height, const Vec3i& node,
                           const SubdivisionOptions& options) {
  const int edge = ValueOctree::edge(height);
  Subvolume s;
  s.cells.lo = node * edge;
  s.cells.hi = componentMin(s.cells.lo + Vec3i{edge, edge, edge}, cells_);
  if (s.cells.empty()) return -1;
  s.edge = edge;
  s.levels = pyramidLevels(edge, options.minimumResolution);
  const Vec3i texture = s.vertices(0);
  const uint64_t bytes =
      uint64_t(texture.x) * uint64_t(texture.y) * uint64_t(texture.z) * uint64_t(options.bytesPerTexel);
  const bool split =
      edge > options.minimumEdge &&
      (bytes > options.memoryLimit || octree.node(height, node).deviation() > options.deviationThreshold);
  const auto number = int32_t(nodes_.size());
  nodes_.push_back({s.cells.lo + Vec3i{edge / 2, edge / 2, edge / 2}, {-1, -1, -1, -1, -1, -1, -1, -1}, -1});
  if (!split) {
    nodes_.back().subvolume = int32_t(subvolumes_.size());
    subvolumes_.push_back(s);
    return number;
  }
  for (int c = 0; c < 8; ++c) {
    const int32_t child = build(octree, height - 1, node * 2 + Vec3i{c & 1, (c >> 1) & 1, c >> 2}, options);
    nodes_[size_t(number)].children[c] = child;
  }
  return number;
}

void Subdivision::mapBlocks(int edge) {
  // The smallest node there is; every subvolume is a union of such blocks.
  blockEdge_ = edge;
  for (int a = 0; a < 3; ++a) blocks_[a] = (cells_[a] + edge - 1) / edge;
  blockOwners_.resize(size_t(blocks_.x) * size_t(blocks_.y) * size_t(blocks_.z));
  for (uint32_t i = 0; i < size(); ++i) {
    const VoxelBox& box = subvolumes_[i].cells;
    for (int z = box.lo.z; z < box.hi.z; z += edge)
      for (int y = box.lo.y; y < box.hi.y; y += edge)
        for (int x = box.lo.x; x < box.hi.x; x += edge)
          blockOwners_[size_t(((z / edge) * blocks_.y + y / edge) * blocks_.x + x / edge)] = i;
  }
}

uint32_t Subdivision::at(const Vec3i& cell) const {
  const Vec3i b{cell.x / blockEdge_, cell.y / blockEdge_, cell.z / blockEdge_};
  return blockOwners_[size_t((b.z * blocks_.y + b.y) * blocks_.x + b.x)];
}

void Subdivision::frontToBack(const Vec3d& eye, bool parallel, std::vector<uint32_t>& order) const {
  order.clear();
  if (!nodes_.empty()) visit(0, eye, parallel, order);
}

// A child can only hide children that lie behind it with respect to some of the three planes: counting from
// the one the eye is in, child n ^ i comes after every one that may hide it.
void Subdivision::visit(int32_t number, const Vec3d& eye, bool parallel, std::vector<uint32_t>& order) const {
  const Node& node = nodes_[size_t(number)];
  if (node.subvolume >= 0) {
    order.push_back(uint32_t(node.subvolume));
    return;
  }
  int nearest = 0;
  for (int a = 0; a < 3; ++a)
    if (parallel ? eye[a] < 0 : eye[a] >= node.middle[a]) nearest |= 1 << a;
  for (int i = 0; i < 8; ++i)
    if (const int32_t child = node.children[nearest ^ i]; child >= 0) visit(child, eye, parallel, order);
}

}  // namespace kairos
