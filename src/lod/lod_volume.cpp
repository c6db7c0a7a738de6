#include "lod/lod_volume.h"

#include <algorithm>

namespace kairos {
namespace {

int levelsNeeded(const Lattice& lattice, const SubdivisionOptions& options) {
  const PointBox box = lattice.samplingBox();
  const Vec3d size = box.hi - box.lo;
  const double longest = std::max({size.x, size.y, size.z});
  int edge = ValueOctree::kLeafEdge;
  while (edge < longest + 2) edge *= 2;
  return pyramidLevels(edge, options.minimumResolution);
}

ScalarPyramid makePyramid(const Lattice& lattice, const Field& field, const SubdivisionOptions& options,
                          ThreadPool& pool, const LodHierarchy* stored) {
  const int levels = levelsNeeded(lattice, options);
  if (stored) return {lattice, field, levels, stored->coarse};
  return {lattice, field, levels, pool};
}

ValueOctree makeOctree(const ScalarPyramid& pyramid, ThreadPool& pool, const LodHierarchy* stored) {
  if (stored) return {pyramid, stored->nodes};
  return {pyramid, pool};
}

}  // namespace

LodVolume::LodVolume(const Lattice& lattice, const Field& field, const SubdivisionOptions& options,
                     ThreadPool& pool, const LodHierarchy* stored)
    : lattice_(lattice),
      pyramid_(makePyramid(lattice, field, options, pool, stored)),
      octree_(makeOctree(pyramid_, pool, stored)),
      subdivision_(octree_, pyramid_, options),
      ranges_(subdivision_.size()),
      deviations_(subdivision_.size()) {
  pool.forEach(subdivision_.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) measure(uint32_t(i));
  });
}

void LodVolume::measure(uint32_t i) {
  const Subvolume& s = subdivision_.subvolumes()[i];
  const Vec3i n = pyramid_.vertices(0);
  float lo = pyramid_.value(0, s.cells.lo), hi = lo;
  for (int z = s.cells.lo.z; z <= s.cells.hi.z; ++z)
    for (int y = s.cells.lo.y; y <= s.cells.hi.y; ++y) {
      const auto row = pyramid_.values(0).begin() + (int64_t(z) * n.y + y) * n.x;
      const auto [least, most] = std::minmax_element(row + s.cells.lo.x, row + s.cells.hi.x + 1);
      lo = std::min(lo, *least);
      hi = std::max(hi, *most);
    }
  ranges_[i] = {lo, hi};
  deviations_[i].clear();
  for (int level = 0; level < s.levels; ++level)
    deviations_[i].push_back(octree_.deviationWithin(s.cells, level));
}

const DirtyBlocks& LodVolume::apply(const ChangedVoxels& changes) {
  const DirtyBlocks& blocks = pyramid_.apply(changes);
  octree_.update(pyramid_, blocks.levels[0]);
  dirty_.clear();
  for (uint32_t i = 0; i < subdivision_.size(); ++i)
    if (!dirtyVertices(subdivision_.subvolumes()[i], 0, blocks.levels[0]).empty()) dirty_.push_back(i);
  for (const uint32_t i : dirty_) measure(i);
  return blocks;
}

VoxelBox dirtyVertices(const Subvolume& subvolume, int level, const std::vector<Vec3i>& blocks) {
  const Vec3i first = subvolume.firstVertex(level), end = first + subvolume.vertices(level);
  VoxelBox dirty;
  for (const Vec3i& block : blocks) {
    const Vec3i lo = block * kDirtyBlockEdge;
    const VoxelBox part{componentMax(lo, first),
                        componentMin(lo + Vec3i{kDirtyBlockEdge, kDirtyBlockEdge, kDirtyBlockEdge}, end)};
    if (!part.empty()) dirty = unite(dirty, {part.lo - first, part.hi - first});
  }
  return dirty;
}

}  // namespace kairos
