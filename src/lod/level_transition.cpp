#include "lod/level_transition.h"

#include <algorithm>
#include <utility>

namespace kairos {
namespace {

// Voxels over which values become finer by one level.
constexpr double kVoxelsPerLevel = 4;

int distanceOutside(int x, int lo, int hi) {
  return std::max({lo - x, x - hi, 0});
}

double interpolated(const ScalarPyramid& pyramid, const Vec3i& v, int level) {
  return LatticePosition(v, level).interpolate([&](const Vec3i& at) { return pyramid.value(level, at); });
}

}  // namespace

LevelTransition::Coarser LevelTransition::coarser(uint32_t j) const {
  const double level = levels_[j];
  return {subdivision_.subvolumes()[j].cells, level,
          std::max(1 / kVoxelsPerLevel, level / subdivision_.smallestEdge())};
}

double LevelTransition::value(const Vec3i& vertex, uint32_t i) const {
  const int level = levels_[i];
  double mixed = level;
  for (const uint32_t j : subdivision_.neighbours(i)) {
    if (levels_[j] <= level) continue;
    const Coarser other = coarser(j);
    int distance = 0;
    for (int a = 0; a < 3; ++a)
      distance = std::max(distance, distanceOutside(vertex[a], other.box.lo[a], other.box.hi[a]));
    mixed = std::max(mixed, other.level - other.slope * distance);
  }
  const int finer = int(mixed);
  const double share = mixed - finer;
  const double value = interpolated(pyramid_, vertex, finer);
  return share > 0 ? value + share * (interpolated(pyramid_, vertex, finer + 1) - value) : value;
}

void LevelTransition::apply(uint32_t i, std::vector<float>& texels) {
  const Subvolume& s = subdivision_.subvolumes()[i];
  const int level = levels_[i];
  std::vector<Coarser> others;
  for (const uint32_t j : subdivision_.neighbours(i))
    if (levels_[j] > level) others.push_back(coarser(j));
  const Vec3i first = s.firstVertex(level), size = s.vertices(level);
  mixed_.assign(size_t(size.x), double(level));
  rows_.resize(size_t(pyramid_.levels()));
  auto row = texels.begin();
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y, row += size.x) {
      const Vec3i start{first.x << level, (first.y + y) << level, (first.z + z) << level};
      const Range range = mixLevels(start, level, others);
      for (auto& values : rows_) values.clear();
      for (int x = range.begin; x < range.end; ++x) {
        const double mixed = std::exchange(mixed_[size_t(x)], double(level));
        const int finer = int(mixed);
        const auto share = float(mixed - finer);
        const auto value = [&](int from) { return interpolatedRow(start, level, from, range)[size_t(x)]; };
        if (finer > level) row[x] = value(finer);
        if (share > 0) row[x] += share * (value(finer + 1) - row[x]);
      }
    }
}

// Finds the levels of the row of vertices that begins at `first`. Returns where they may be coarser than
// `level`.
LevelTransition::Range LevelTransition::mixLevels(const Vec3i& first, int level,
                                                  const std::vector<Coarser>& coarser) {
  Range range{int(mixed_.size()), 0};
  for (const Coarser& other : coarser) {
    const int across = std::max(distanceOutside(first.y, other.box.lo.y, other.box.hi.y),
                                distanceOutside(first.z, other.box.lo.z, other.box.hi.z));
    if (other.level - other.slope * across <= level) continue;
    const int reach = int((other.level - level) / other.slope) + 1;
    const int begin = std::max(0, (other.box.lo.x - reach - first.x) >> level);
    const int end = std::min(int(mixed_.size()), ((other.box.hi.x + reach - first.x) >> level) + 1);
    for (int x = begin; x < end; ++x) {
      const int along = distanceOutside(first.x + (x << level), other.box.lo.x, other.box.hi.x);
      double& mixed = mixed_[size_t(x)];
      mixed = std::max(mixed, other.level - other.slope * std::max(across, along));
    }
    range = {std::min(range.begin, begin), std::max(range.end, end)};
  }
  return range;
}

// The values of level `from`, interpolated at the row's vertices of the range.
const std::vector<float>& LevelTransition::interpolatedRow(const Vec3i& first, int level, int from,
                                                           const Range& range) {
  std::vector<float>& row = rows_[size_t(from)];
  if (!row.empty()) return row;
  const int shift = from - level, cell = 1 << shift;
  const LatticePosition p(first, from);
  const int offset = (first.x - (p.low.x << from)) >> level;
  const int low = (offset + range.begin) >> shift, high = ((offset + range.end - 1) >> shift) + 1;
  const Vec3i n = pyramid_.vertices(from);
  coarseRow_.assign(size_t(high - low) + 1, 0);
  // The last vertex may be that of the volume, and no cell lie beyond.
  const size_t count = coarseRow_.size() - (p.low.x + high < n.x ? 0 : 1);
  for (int corner = 0; corner < 4; ++corner) {
    const int y = corner & 1, z = corner >> 1;
    const auto weight = float((y ? p.above[1] : 1 - p.above[1]) * (z ? p.above[2] : 1 - p.above[2]));
    if (weight == 0) continue;
    const float* values =
        &pyramid_.values(from)[(size_t(p.low.z + z) * size_t(n.y) + size_t(p.low.y + y)) * size_t(n.x) +
                               size_t(p.low.x + low)];
    for (size_t x = 0; x < count; ++x) coarseRow_[x] += weight * values[x];
  }
  row.resize(mixed_.size());
  for (int x = range.begin; x < range.end; ++x) {
    const float* at = &coarseRow_[size_t(((offset + x) >> shift) - low)];
    row[size_t(x)] = at[0] + float((offset + x) & (cell - 1)) / float(cell) * (at[1] - at[0]);
  }
  return row;
}

}  // namespace kairos
