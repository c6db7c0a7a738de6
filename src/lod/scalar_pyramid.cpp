#include "lod/scalar_pyramid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace kairos {
namespace {

Vec3i blockOf(const Vec3i& vertex) {
  return {vertex.x / kDirtyBlockEdge, vertex.y / kDirtyBlockEdge, vertex.z / kDirtyBlockEdge};
}

Vec3i blockCount(const Vec3i& vertices) {
  return blockOf(vertices - Vec3i{1, 1, 1}) + Vec3i{1, 1, 1};
}

size_t linear(const Vec3i& v, const Vec3i& size) {
  return (size_t(v.z) * size_t(size.y) + size_t(v.y)) * size_t(size.x) + size_t(v.x);
}

template <class F>
void forEachVoxel(const VoxelBox& box, F&& f) {
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      for (int x = box.lo.x; x < box.hi.x; ++x) f(Vec3i{x, y, z});
}

// Where the neighbour `offset` of fine vertex 2j is read, mirrored at both ends of the `coarse` cells and
// completed where there is no fine vertex.
int sourceIndex(int j, int offset, int coarse, int fine) {
  int i = std::abs(2 * j + offset);
  if (i > 2 * coarse) i = 4 * coarse - i;
  return std::min(i, fine);
}

}  // namespace

int pyramidLevels(int cells, int minimumCells) {
  int levels = 1;
  for (; cells / 2 >= minimumCells; cells /= 2) ++levels;
  return levels;
}

ScalarPyramid::ScalarPyramid(const Lattice& lattice, const Field& field, int levels, ThreadPool& pool)
    : lattice_(lattice) {
  allocate(levels);
  fill(field);
  for (int l = 1; l < levels; ++l) {
    const Vec3i n = vertices(l);
    pool.forEach(size_t(n.z), 1, [&](size_t begin, size_t end) {
      forEachVoxel({{0, 0, int(begin)}, {n.x, n.y, int(end)}},
                   [&](const Vec3i& v) { at(l, v) = restricted(l, v); });
    });
  }
}

ScalarPyramid::ScalarPyramid(const Lattice& lattice, const Field& field, int levels,
                             std::span<const float> coarse)
    : lattice_(lattice) {
  allocate(levels);
  fill(field);
  size_t needed = 0;
  for (int l = 1; l < levels; ++l) needed += values_[size_t(l)].size();
  if (needed != coarse.size())
    throw StateError("the stored levels of detail hold " + std::to_string(coarse.size()) +
                     " values, expected " + std::to_string(needed));
  for (auto level = values_.begin() + 1; level != values_.end(); ++level) {
    std::copy_n(coarse.begin(), level->size(), level->begin());
    coarse = coarse.subspan(level->size());
  }
}

std::vector<float> ScalarPyramid::coarseValues() const {
  std::vector<float> all;
  for (size_t l = 1; l < values_.size(); ++l) all.insert(all.end(), values_[l].begin(), values_[l].end());
  return all;
}

void ScalarPyramid::allocate(int levels) {
  const PointBox box = lattice_.samplingBox();
  Vec3i cells;
  std::vector<Vec3i> copies{{0, 0, 0}};
  for (int a = 0; a < 3; ++a) {
    origin_[a] = int(std::floor(box.lo[a]));
    cells[a] = std::max(1, int(std::ceil(box.hi[a])) - origin_[a]);
    if (!lattice_.dense || lattice_.domain.size()[a] != 1) continue;
    const size_t count = copies.size();
    for (size_t i = 0; i < count; ++i)
      for (int side : {-1, 1}) {
        copies.push_back(copies[i]);
        copies.back()[a] = side;
      }
  }
  copies_ = std::move(copies);
  background_ = std::isfinite(lattice_.background) ? float(lattice_.background) : 0.0f;
  for (int l = 0; l < levels; ++l) {
    const Vec3i n = cells + Vec3i{1, 1, 1};
    sizes_.push_back(n);
    values_.emplace_back(size_t(n.x) * size_t(n.y) * size_t(n.z), background_);
    const Vec3i blocks = blockCount(n);
    marked_.emplace_back(size_t(blocks.x) * size_t(blocks.y) * size_t(blocks.z), 0);
    for (int a = 0; a < 3; ++a) cells[a] = (cells[a] + 1) / 2;
  }
  dirty_.levels.resize(size_t(levels));
}

void ScalarPyramid::fill(const Field& field) {
  const auto put = [&](const auto& values) {
    using T = typename std::decay_t<decltype(values)>::value_type;
    for (size_t leaf = 0; leaf < field.leafCount(); ++leaf)
      for (int i = 0; i < kLeafVoxels; ++i) {
        const Vec3i v = field.leafOrigins[leaf] + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
        if (!lattice_.domain.contains(v)) continue;
        const T value = values[leaf * kLeafVoxels + size_t(i)];
        for (const Vec3i& copy : copies_)
          at(0, v + copy - origin_) = isFiniteValue(value) ? float(value) : background_;
      }
  };
  std::visit(put, field.values);
}

float ScalarPyramid::restricted(int level, const Vec3i& v) const {
  const Vec3i coarse = vertices(level) - Vec3i{1, 1, 1}, n = vertices(level - 1), fine = n - Vec3i{1, 1, 1};
  const std::vector<float>& from = values_[size_t(level) - 1];
  constexpr double kWeight[] = {0.25, 0.5, 0.25};
  size_t index[3][3];
  const size_t stride[] = {1, size_t(n.x), size_t(n.x) * size_t(n.y)};
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < 3; ++k)
      index[a][k] = size_t(sourceIndex(v[a], k - 1, coarse[a], fine[a])) * stride[a];
  double sum = 0;
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x)
        sum += kWeight[x] * kWeight[y] * kWeight[z] * double(from[index[0][x] + index[1][y] + index[2][z]]);
  return float(sum);
}

const DirtyBlocks& ScalarPyramid::apply(const ChangedVoxels& changes) {
  check(changes);
  for (auto& blocks : dirty_.levels) blocks.clear();
  dirty_.verticesComputed = 0;
  dispatch(changes.type(), [&]<class T>() { write<T>(changes); });
  for (int l = 1; l < levels(); ++l) updateLevel(l);
  for (size_t l = 0; l < dirty_.levels.size(); ++l) {
    std::sort(dirty_.levels[l].begin(), dirty_.levels[l].end(), lessZYX);
    const Vec3i blocks = blockCount(sizes_[l]);
    for (const Vec3i& block : dirty_.levels[l]) marked_[l][linear(block, blocks)] = 0;
  }
  return dirty_;
}

void ScalarPyramid::check(const ChangedVoxels& changes) const {
  if (changes.type() != lattice_.type)
    throw StateError("changed voxels of type " + std::string(name(changes.type())) + ", expected " +
                     std::string(name(lattice_.type)));
  for (const ChangedLeaf& leaf : changes.leaves)
    for (int i = 0; i < kLeafVoxels; ++i) {
      if (!(leaf.mask[size_t(i >> 6)] >> (i & 63) & 1)) continue;
      const Vec3i v = leaf.origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
      if (!lattice_.domain.contains(v))
        throw StateError("changed voxel (" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " +
                         std::to_string(v.z) + ") lies outside the volume");
    }
}

template <class T>
void ScalarPyramid::write(const ChangedVoxels& changes) {
  const std::vector<T>& values = valuesAs<T>(changes.values);
  for (const ChangedLeaf& leaf : changes.leaves) {
    size_t next = leaf.first;
    for (int i = 0; i < kLeafVoxels; ++i) {
      if (!(leaf.mask[size_t(i >> 6)] >> (i & 63) & 1)) continue;
      const T value = values[next++];
      const float stored = isFiniteValue(value) ? float(value) : background_;
      const Vec3i vertex = leaf.origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6} - origin_;
      for (const Vec3i& copy : copies_) {
        float& place = at(0, vertex + copy);
        if (place == stored) continue;
        place = stored;
        markDirty(0, vertex + copy);
      }
    }
  }
}

void ScalarPyramid::markDirty(int level, const Vec3i& vertex) {
  const Vec3i block = blockOf(vertex);
  char& mark = marked_[size_t(level)][linear(block, blockCount(sizes_[size_t(level)]))];
  if (mark) return;
  mark = 1;
  dirty_.levels[size_t(level)].push_back(block);
}

// Vertex j depends on fine vertices 2j - 1 to 2j + 1.
void ScalarPyramid::updateLevel(int level) {
  constexpr int kHalf = kDirtyBlockEdge / 2;
  for (const Vec3i& block : dirty_.levels[size_t(level) - 1]) {
    const Vec3i lo = block * kHalf;
    forEachVoxel({lo, componentMin(lo + Vec3i{kHalf + 1, kHalf + 1, kHalf + 1}, vertices(level))},
                 [&](const Vec3i& v) {
                   const float value = restricted(level, v);
                   ++dirty_.verticesComputed;
                   if (at(level, v) == value) return;
                   at(level, v) = value;
                   markDirty(level, v);
                 });
  }
}

}  // namespace kairos
