#include "lod/value_octree.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace kairos {
namespace {

size_t linear(const Vec3i& v, const Vec3i& size) {
  return (size_t(v.z) * size_t(size.y) + size_t(v.y)) * size_t(size.x) + size_t(v.x);
}

Vec3i shifted(const Vec3i& v, int by) {
  return {v.x >> by, v.y >> by, v.z >> by};
}

template <class F>
void forEachIn(const VoxelBox& box, F&& f) {
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      for (int x = box.lo.x; x < box.hi.x; ++x) f(Vec3i{x, y, z});
}

// In two passes: exact also where the values are large and vary little.
NodeStatistics measure(const ScalarPyramid& pyramid, const VoxelBox& box) {
  NodeStatistics s;
  s.count = box.voxelCount();
  double sum = 0;
  forEachIn(box, [&](const Vec3i& v) { sum += double(pyramid.value(0, v)); });
  s.mean = sum / double(s.count);
  forEachIn(box, [&](const Vec3i& v) {
    const double d = double(pyramid.value(0, v)) - s.mean;
    s.squares += d * d;
  });
  return s;
}

double squaresWithinBlocks(const ScalarPyramid& pyramid, const VoxelBox& box, int edge) {
  double sum = 0;
  for (int z = box.lo.z; z < box.hi.z; z += edge)
    for (int y = box.lo.y; y < box.hi.y; y += edge)
      for (int x = box.lo.x; x < box.hi.x; x += edge)
        sum += measure(pyramid, {{x, y, z}, componentMin({x + edge, y + edge, z + edge}, box.hi)}).squares;
  return sum;
}

}  // namespace

double NodeStatistics::deviation() const {
  return count ? std::sqrt(squares / double(count)) : 0;
}

void NodeStatistics::merge(const NodeStatistics& other) {
  if (other.count == 0) return;
  const double total = double(count + other.count), d = other.mean - mean;
  squares += other.squares + d * d * double(count) * double(other.count) / total;
  mean += d * double(other.count) / total;
  count += other.count;
  for (size_t i = 0; i < squaresWithin.size(); ++i) squaresWithin[i] += other.squaresWithin[i];
}

ValueOctree::ValueOctree(const ScalarPyramid& pyramid, ThreadPool& pool) {
  allocate(pyramid.vertices(0));
  for (int h = 0; h <= height(); ++h) {
    const Vec3i n = nodes(h);
    pool.forEach(size_t(n.y) * size_t(n.z), 4, [&](size_t begin, size_t end) {
      for (size_t row = begin; row < end; ++row)
        for (int x = 0; x < n.x; ++x) {
          const Vec3i node{x, int(row % size_t(n.y)), int(row / size_t(n.y))};
          if (h == 0)
            measureLeaf(pyramid, node);
          else
            mergeChildren(h, node);
        }
    });
  }
}

ValueOctree::ValueOctree(const ScalarPyramid& pyramid, std::span<const NodeStatistics> stored) {
  allocate(pyramid.vertices(0));
  size_t needed = 0;
  for (const auto& level : levels_) needed += level.size();
  if (needed != stored.size())
    throw StateError("the stored octree has " + std::to_string(stored.size()) + " nodes, expected " +
                     std::to_string(needed));
  for (auto& level : levels_) {
    std::copy_n(stored.begin(), level.size(), level.begin());
    stored = stored.subspan(level.size());
  }
}

std::vector<NodeStatistics> ValueOctree::all() const {
  std::vector<NodeStatistics> nodes;
  for (const auto& level : levels_) nodes.insert(nodes.end(), level.begin(), level.end());
  return nodes;
}

void ValueOctree::allocate(const Vec3i& vertices) {
  const Vec3i one{1, 1, 1};
  for (Vec3i last = shifted(vertices - one, 3);; last = shifted(last, 1)) {
    const Vec3i n = last + one;
    sizes_.push_back(n);
    levels_.emplace_back(size_t(n.x) * size_t(n.y) * size_t(n.z));
    if (n == one) break;
  }
}

const NodeStatistics& ValueOctree::node(int height, const Vec3i& node) const {
  return levels_[size_t(height)][linear(node, sizes_[size_t(height)])];
}

NodeStatistics& ValueOctree::at(int height, const Vec3i& node) {
  return levels_[size_t(height)][linear(node, sizes_[size_t(height)])];
}

void ValueOctree::measureLeaf(const ScalarPyramid& pyramid, const Vec3i& leaf) {
  const Vec3i lo = leaf * kLeafEdge;
  const VoxelBox box{lo, componentMin(lo + Vec3i{kLeafEdge, kLeafEdge, kLeafEdge}, pyramid.vertices(0))};
  NodeStatistics s = measure(pyramid, box);
  s.squaresWithin = {squaresWithinBlocks(pyramid, box, 2), squaresWithinBlocks(pyramid, box, 4)};
  at(0, leaf) = s;
}

void ValueOctree::mergeChildren(int height, const Vec3i& node) {
  NodeStatistics merged;
  const Vec3i lo = node * 2;
  forEachIn({lo, componentMin(lo + Vec3i{2, 2, 2}, nodes(height - 1))},
            [&](const Vec3i& child) { merged.merge(at(height - 1, child)); });
  at(height, node) = merged;
}

double ValueOctree::deviationWithin(const VoxelBox& box, int level) const {
  if (level == 0) return 0;
  const int h = std::min(std::max(0, level - 3), height());
  const Vec3i one{1, 1, 1};
  const VoxelBox covered{shifted(box.lo, 3 + h), componentMin(shifted(box.hi - one, 3 + h) + one, nodes(h))};
  double squares = 0;
  int64_t count = 0;
  forEachIn(covered, [&](const Vec3i& n) {
    const NodeStatistics& s = node(h, n);
    squares += level < 3 ? s.squaresWithin[size_t(level) - 1] : s.squares;
    count += s.count;
  });
  return count ? std::sqrt(squares / double(count)) : 0;
}

void ValueOctree::update(const ScalarPyramid& pyramid, std::span<const Vec3i> leaves) {
  for (const Vec3i& leaf : leaves) measureLeaf(pyramid, leaf);
  std::vector<Vec3i> nodesAbove(leaves.begin(), leaves.end());
  for (int h = 1; h <= height(); ++h) {
    for (Vec3i& n : nodesAbove) n = shifted(n, 1);
    std::sort(nodesAbove.begin(), nodesAbove.end(), lessZYX);
    nodesAbove.erase(std::unique(nodesAbove.begin(), nodesAbove.end()), nodesAbove.end());
    for (const Vec3i& n : nodesAbove) mergeChildren(h, n);
  }
}

}  // namespace kairos
