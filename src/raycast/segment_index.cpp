#include "raycast/segment_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace kairos {
namespace {

// A run of samples of one owner ray in one cell.
struct Run {
  Vec3i cell;
  int32_t kBegin, kEnd;
};

// Walks the cells an owner ray passes between samples begin and end, in order (a 3D DDA in sample indices:
// the next cell is entered at the smallest of three integers, so no position is ever accumulated).
template <class Visit>
void walkCells(const LatticeRay& ray, const Vec3i& gridSize, int32_t begin, int32_t end, Visit&& visit) {
  if (begin >= end) return;
  Vec3i cell;
  std::array<int32_t, 3> next{};
  const auto nextCrossing = [&](int a) {
    const double plane = double(cell[a] + (ray.delta[a] < 0 ? 0 : 1)) * kBrickEdge;
    return firstSampleBeyond(plane, ray.origin[a], ray.delta[a]);
  };
  const auto entryCrossing = [&](int a) {
    const double plane = double(cell[a] + (ray.delta[a] < 0 ? 1 : 0)) * kBrickEdge;
    return firstSampleBeyond(plane, ray.origin[a], ray.delta[a]);
  };
  for (int a = 0; a < 3; ++a) {
    const double at = ray.origin[a] + (begin + 0.5) * ray.delta[a];
    cell[a] = std::clamp(int32_t(std::floor(at / kBrickEdge)), 0, gridSize[a] - 1);
    // The crossings decide, not the rounded position: step until sample `begin` lies between two of them.
    if (const int32_t back = cell[a] + (ray.delta[a] < 0 ? 1 : -1);
        back >= 0 && back < gridSize[a] && entryCrossing(a) > begin)
      cell[a] = back;
    while ((next[size_t(a)] = nextCrossing(a)) <= begin) {
      const int32_t moved = cell[a] + (ray.delta[a] < 0 ? -1 : 1);
      if (moved < 0 || moved >= gridSize[a]) break;
      cell[a] = moved;
    }
  }
  int32_t k = begin;
  while (k < end) {
    const int a = next[0] <= next[1] ? (next[0] <= next[2] ? 0 : 2) : (next[1] <= next[2] ? 1 : 2);
    const int32_t stop = std::min(next[size_t(a)], end);
    if (stop > k) visit(Run{cell, k, stop});
    k = std::max(k, stop);
    if (k >= end) return;
    cell[a] += ray.delta[a] < 0 ? -1 : 1;
    if (cell[a] < 0 || cell[a] >= gridSize[a]) return;
    next[size_t(a)] = nextCrossing(a);
  }
}

LatticeRay laneOwner(const ViewRays& view, const TileRays& rays, int lane) {
  LatticeRay ray;
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = rays.origin[a][lane] + view.footprintShift();
    ray.delta[a] = rays.delta[a][lane];
  }
  return ray;
}

// How many cell faces lie between the eye's cell and `cell`: grows by one at every face any ray of the view
// crosses, so sorting by it is front to back for all rays at once.
class DepthOrder {
 public:
  DepthOrder(const ViewRays& view, const TileRays& rays) {
    for (int a = 0; a < 3; ++a) {
      perspective_ = view.perspective();
      start_[a] =
          int32_t(std::clamp(std::floor((view.eye()[a] + view.footprintShift()) / kBrickEdge), -1e9, 1e9));
      sign_[a] = rays.delta[a][0] < 0 ? -1 : 1;
    }
  }
  int64_t operator()(const Vec3i& cell) const {
    int64_t order = 0;
    for (int a = 0; a < 3; ++a)
      order += perspective_ ? std::abs(int64_t(cell[a]) - start_[a]) : int64_t(cell[a]) * sign_[a];
    return order;
  }

 private:
  bool perspective_;
  Vec3i start_, sign_;
};

void listLaneOwned(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                   std::vector<Segment>& segments) {
  struct Ordered {
    int64_t order;
    Segment segment;
  };
  std::vector<Ordered> found;
  const DepthOrder order(view, rays);
  for (int l = 0; l < kLanes; ++l)
    walkCells(laneOwner(view, rays, l), gridSize, rays.kBegin[l], rays.kEnd[l], [&](const Run& run) {
      found.push_back({order(run.cell), {cellIndex(run.cell, gridSize), run.kBegin, run.kEnd}});
    });
  std::sort(found.begin(), found.end(), [](const Ordered& a, const Ordered& b) {
    return a.order != b.order ? a.order < b.order : a.segment.cell < b.segment.cell;
  });
  for (size_t i = 0; i < found.size(); ++i) {
    Segment& s = found[i].segment;
    if (i > 0 && s.cell == segments.back().cell) {
      segments.back().kBegin = std::min(segments.back().kBegin, s.kBegin);
      segments.back().kEnd = std::max(segments.back().kEnd, s.kEnd);
    } else {
      segments.push_back(s);
    }
  }
}

}  // namespace

void listSegments(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                  std::vector<Segment>& segments) {
  if (!rays.packetOwned) return listLaneOwned(view, rays, gridSize, segments);
  walkCells(rays.owner, gridSize, rays.firstSample(), rays.lastSample(), [&](const Run& run) {
    segments.push_back({cellIndex(run.cell, gridSize), run.kBegin, run.kEnd});
  });
}

namespace {

// Bits of the sub-blocks that voxels [lo, hi] of one axis fall in, spread over that axis of the 4^3 mask.
struct SubBlockSpread {
  std::array<uint64_t, 16> x{}, y{}, z{};
  constexpr SubBlockSpread() {
    for (int bits = 0; bits < 16; ++bits)
      for (int b = 0; b < 64; ++b) {
        const uint64_t one = uint64_t(1) << b;
        if (bits >> (b & 3) & 1) x[size_t(bits)] |= one;
        if (bits >> ((b >> 2) & 3) & 1) y[size_t(bits)] |= one;
        if (bits >> (b >> 4) & 1) z[size_t(bits)] |= one;
      }
  }
};
constexpr SubBlockSpread kSpread;

// Parts `first` to `last` of one axis, a bit each.
size_t axisBits(int first, int last) {
  return size_t(((2 << last) - 1) & ~((1 << first) - 1));
}

// The union over a segment's samples of parts of its brick. `bits(lo, hi)` gives those of one axis for
// samples whose footprints start at voxels lo to hi.
template <class Bits>
uint64_t partsAlong(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize, const Segment& segment,
                    Bits&& bits) {
  const Vec3i cell = cellCoordinates(segment.cell, gridSize);
  double o0[3], o1[3], d0[3], d1[3];
  for (int a = 0; a < 3; ++a) {
    const double base = double(cell[a] * kBrickEdge) - view.footprintShift();
    o0[a] = *std::min_element(rays.origin[a], rays.origin[a] + kLanes) - base;
    o1[a] = *std::max_element(rays.origin[a], rays.origin[a] + kLanes) - base;
    d0[a] = *std::min_element(rays.delta[a], rays.delta[a] + kLanes);
    d1[a] = *std::max_element(rays.delta[a], rays.delta[a] + kLanes);
  }
  constexpr double kRounding = 1e-3;  // the kernel's positions are floats
  uint64_t mask = 0;
  for (int32_t k = segment.kBegin; k < segment.kEnd; ++k) {
    const double t = k + 0.5;
    size_t axis[3];
    for (int a = 0; a < 3; ++a)
      axis[a] = bits(int(std::floor(o0[a] + t * d0[a] - kRounding)),
                     int(std::floor(o1[a] + t * d1[a] + kRounding)));
    mask |= kSpread.x[axis[0]] & kSpread.y[axis[1]] & kSpread.z[axis[2]];
  }
  return mask;
}

}  // namespace

uint64_t touchedSubBlocks(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                          const Segment& segment) {
  return partsAlong(view, rays, gridSize, segment, [&](int lo, int hi) {
    hi += view.footprintWidth() - 1;
    return axisBits(std::clamp(lo, 0, kBrickStride - 1) / kSubBlockEdge,
                    std::clamp(hi, 0, kBrickStride - 1) / kSubBlockEdge);
  });
}

uint64_t touchedWindows(const ViewRays& view, const TileRays& rays, const Vec3i& gridSize,
                        const Segment& segment) {
  return partsAlong(view, rays, gridSize, segment, [](int lo, int hi) {
    return axisBits(std::clamp(lo, 0, kBrickEdge - 1) / kWindowBlock,
                    std::clamp(hi, 0, kBrickEdge - 1) / kWindowBlock);
  });
}

SegmentIndex::SegmentIndex(const ViewRays& view, const BrickVolume& volume, ThreadPool& pool) {
  const auto tiles = size_t(view.tileCount());
  sampling_.resize(tiles);
  std::vector<std::vector<Segment>> rows(static_cast<size_t>(view.tilesY()));
  tileBegin_.assign(tiles + 1, 0);
  pool.forEach(rows.size(), 1, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row)
      for (int x = 0; x < view.tilesX(); ++x) {
        const size_t tile = row * size_t(view.tilesX()) + size_t(x);
        const TileRays rays = view.rays(int(tile));
        sampling_[tile] = rays;
        const size_t before = rows[row].size();
        listSegments(view, rays, volume.gridSize(), rows[row]);
        tileBegin_[tile + 1] = rows[row].size() - before;
      }
  });
  std::partial_sum(tileBegin_.begin(), tileBegin_.end(), tileBegin_.begin());
  segments_.reserve(tileBegin_.back());
  for (const auto& row : rows) segments_.insert(segments_.end(), row.begin(), row.end());
}

void SegmentIndex::rays(const ViewRays& view, int tile, TileRays& rays) const {
  view.geometry(tile, rays);
  static_cast<TileSampling&>(rays) = sampling_[size_t(tile)];
}

void SegmentIndex::buildBrickIndex(const ViewRays& view, const BrickVolume& volume, ThreadPool& pool) {
  subBlocks_.resize(segments_.size());
  tileOf_.resize(segments_.size());
  pool.forEach(size_t(view.tileCount()), 64, [&](size_t first, size_t last) {
    TileRays tileRays;
    for (size_t tile = first; tile < last; ++tile) {
      if (tileBegin_[tile] == tileBegin_[tile + 1]) continue;
      rays(view, int(tile), tileRays);
      for (size_t s = tileBegin_[tile]; s < tileBegin_[tile + 1]; ++s) {
        subBlocks_[s] = touchedSubBlocks(view, tileRays, volume.gridSize(), segments_[s]);
        tileOf_[s] = uint32_t(tile);
      }
    }
  });
  cellBegin_.assign(size_t(volume.cellCount()) + 1, 0);
  for (const Segment& s : segments_) ++cellBegin_[s.cell + 1];
  std::partial_sum(cellBegin_.begin(), cellBegin_.end(), cellBegin_.begin());
  cellSegments_.resize(segments_.size());
  std::vector<uint64_t> next(cellBegin_.begin(), cellBegin_.end() - 1);
  for (size_t s = 0; s < segments_.size(); ++s) cellSegments_[next[segments_[s].cell]++] = uint32_t(s);
}

uint64_t SegmentIndex::memoryBytes() const {
  return tileBegin_.size() * sizeof(uint64_t) + sampling_.size() * sizeof(TileSampling) +
         segments_.size() * sizeof(Segment) + cellBegin_.size() * sizeof(uint64_t) +
         (cellSegments_.size() + tileOf_.size()) * sizeof(uint32_t) + subBlocks_.size() * sizeof(uint64_t);
}

}  // namespace kairos
