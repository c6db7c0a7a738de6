#include "lod/boundary_copy.h"

#include <algorithm>
#include <limits>

namespace kairos {
namespace {

// Values on the faces of subvolume i, as its neighbours have them.
class BoundaryValues {
 public:
  BoundaryValues(const ScalarPyramid& pyramid, const Subdivision& subdivision, const SubvolumeLevels& levels,
                 const LevelTransition& transition, uint32_t i)
      : subdivision_(subdivision),
        levels_(levels),
        transition_(transition),
        last_(pyramid.cells() - Vec3i{1, 1, 1}),
        box_(subdivision.subvolumes()[i].cells),
        known_(size_t(pyramid.levels())) {}

  // The coarsest of the subvolumes that a vertex of level 0 belongs to.
  uint32_t coarsestAt(const Vec3i& v) const {
    // Of the two cells along an axis that share the vertex, only those of different blocks can have different
    // owners.
    const int edge = subdivision_.smallestEdge();
    const Vec3i steps{v.x & (edge - 1) ? 0 : 1, v.y & (edge - 1) ? 0 : 1, v.z & (edge - 1) ? 0 : 1};
    uint32_t coarsest = subdivision_.at(inside(v));
    for (int z = 0; z <= steps.z; ++z)
      for (int y = 0; y <= steps.y; ++y)
        for (int x = 0; x <= steps.x; ++x) {
          const uint32_t j = subdivision_.at(inside({v.x - x, v.y - y, v.z - z}));
          if (levels_[j] > levels_[coarsest]) coarsest = j;
        }
    return coarsest;
  }

  // The value at vertex `v` (counted in level 0), interpolated as in a subvolume of this level.
  float interpolated(const Vec3i& v, int level) {
    return float(LatticePosition(v, level).interpolate([&](const Vec3i& at) { return value(at, level); }));
  }

 private:
  Vec3i inside(const Vec3i& cell) const { return componentMax({0, 0, 0}, componentMin(cell, last_)); }

  // The value at a vertex, counted in this level, of a subvolume that has it. Neighbouring vertices of i ask
  // for the same ones.
  float value(const Vec3i& vertex, int level) {
    std::vector<float>& known = known_[size_t(level)];
    const Vec3i first{box_.lo.x >> level, box_.lo.y >> level, box_.lo.z >> level};
    const Vec3i last{(box_.hi.x >> level) + 1, (box_.hi.y >> level) + 1, (box_.hi.z >> level) + 1};
    const Vec3i n = last - first + Vec3i{1, 1, 1};
    if (known.empty()) known.assign(size_t(n.x) * size_t(n.y) * size_t(n.z), kUnknown);
    const Vec3i at = vertex - first;
    float& kept = known[(size_t(at.z) * size_t(n.y) + size_t(at.y)) * size_t(n.x) + size_t(at.x)];
    if (kept == kUnknown) {
      const Vec3i v = vertex * (1 << level);
      const uint32_t coarsest = coarsestAt(v);
      kept = levels_[coarsest] > level ? interpolated(v, levels_[coarsest])
                                       : float(transition_.value(v, coarsest));
    }
    return kept;
  }

  static constexpr float kUnknown = -std::numeric_limits<float>::infinity();

  const Subdivision& subdivision_;
  const SubvolumeLevels& levels_;
  const LevelTransition& transition_;
  Vec3i last_;
  VoxelBox box_;
  std::vector<std::vector<float>> known_;  // per level, around the subvolume
};

void crop(const ScalarPyramid& pyramid, int level, const VoxelBox& box, std::vector<float>& texels) {
  const Vec3i n = pyramid.vertices(level), size = box.size();
  const std::vector<float>& values = pyramid.values(level);
  texels.resize(size_t(box.voxelCount()));
  auto to = texels.begin();
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      to = std::copy_n(values.begin() + (int64_t(z) * n.y + y) * n.x + box.lo.x, size.x, to);
}

bool hasCoarserNeighbour(const Subdivision& subdivision, const SubvolumeLevels& levels, uint32_t i) {
  const auto& neighbours = subdivision.neighbours(i);
  return std::any_of(neighbours.begin(), neighbours.end(), [&](uint32_t j) { return levels[j] > levels[i]; });
}

// SplitMix64's finaliser.
uint64_t mixed(uint64_t x) {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ x >> 27) * 0x94d049bb133111ebull;
  return x ^ x >> 31;
}

// Hashes, added up whatever their order, of the neighbours coarser than subvolume i and of what is coarser
// than these in turn, but for those already among `found`, a bit each.
uint64_t hashCoarser(const Subdivision& subdivision, const SubvolumeLevels& levels, uint32_t i,
                     std::vector<uint64_t>& found) {
  uint64_t hash = 0;
  for (const uint32_t j : subdivision.neighbours(i)) {
    if (levels[j] <= levels[i] || found[j / 64] >> j % 64 & 1) continue;
    found[j / 64] |= uint64_t(1) << j % 64;
    hash += mixed(uint64_t(j) << 8 | levels[j]) + hashCoarser(subdivision, levels, j, found);
  }
  return hash;
}

}  // namespace

void copyTexels(const ScalarPyramid& pyramid, const Subdivision& subdivision, const SubvolumeLevels& levels,
                uint32_t i, std::vector<float>& texels) {
  const Subvolume& s = subdivision.subvolumes()[i];
  const int level = levels[i];
  const Vec3i first = s.firstVertex(level), size = s.vertices(level), last = size - Vec3i{1, 1, 1};
  crop(pyramid, level, {first, first + size}, texels);
  if (!hasCoarserNeighbour(subdivision, levels, i)) return;
  LevelTransition transition(pyramid, subdivision, levels);
  transition.apply(i, texels);
  BoundaryValues boundary(pyramid, subdivision, levels, transition, i);
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y) {
      const bool face = z == 0 || z == last.z || y == 0 || y == last.y;
      for (int x = 0; x < size.x; x += face ? 1 : last.x) {
        const Vec3i v{(first.x + x) << level, (first.y + y) << level, (first.z + z) << level};
        const int coarsest = levels[boundary.coarsestAt(v)];
        if (coarsest > level)
          texels[size_t((z * size.y + y) * size.x + x)] = boundary.interpolated(v, coarsest);
      }
    }
}

uint64_t boundarySignature(const Subdivision& subdivision, const SubvolumeLevels& levels, uint32_t i) {
  // Asked for every level of every subvolume in every frame: nothing is allocated.
  thread_local std::vector<uint64_t> found;
  found.assign((levels.size() + 63) / 64, 0);
  return hashCoarser(subdivision, levels, i, found);
}

}  // namespace kairos
