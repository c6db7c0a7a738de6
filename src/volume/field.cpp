#include "volume/field.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "volume/voxel_checksum.h"

namespace kairos {
int64_t Field::findLeaf(const Vec3i& origin) const {
  const auto it = std::lower_bound(leafOrigins.begin(), leafOrigins.end(), origin, lessZYX);
  return it != leafOrigins.end() && *it == origin ? it - leafOrigins.begin() : -1;
}

double Field::value(const Vec3i& v) const {
  const Vec3i origin = leafOriginOf(v);
  const int64_t leaf = findLeaf(origin);
  if (leaf < 0) return background;
  const Vec3i local = v - origin;
  return std::visit(
      [&](const auto& a) {
        return double(a[size_t(leaf) * kLeafVoxels + leafOffset(local.x, local.y, local.z)]);
      },
      values);
}

Vec3i Lattice::sourceOf(const Vec3i& voxel) const {
  const Vec3i one{1, 1, 1};
  if (!dense || domain.contains(voxel) || !VoxelBox{domain.lo - one, domain.hi + one}.contains(voxel))
    return voxel;
  return componentMin(componentMax(voxel, domain.lo), domain.hi - one);
}

PointBox Lattice::samplingBox() const {
  if (domain.empty()) return {Vec3d(domain.lo), Vec3d(domain.lo)};
  PointBox box{Vec3d(domain.lo), Vec3d(domain.hi - Vec3i{1, 1, 1})};
  for (int a = 0; a < 3; ++a) {
    // A dense axis of one voxel has no extent between voxel centres; it gets the voxel's own.
    const double margin = !dense ? 1.0 : domain.hi[a] - domain.lo[a] == 1 ? 0.5 : 0.0;
    box.lo[a] -= margin;
    box.hi[a] += margin;
  }
  return box;
}

PointBox Lattice::worldBounds() const {
  const PointBox box = samplingBox();
  PointBox world;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p = worldFromIndex.point({corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                                          corner & 4 ? box.hi.z : box.lo.z});
    world.lo = corner ? componentMin(world.lo, p) : p;
    world.hi = corner ? componentMax(world.hi, p) : p;
  }
  return world;
}

template <class T>
Field fieldFromDense(const T* values, const Vec3i& dims, T background, const Vec3i& origin) {
  Field field;
  field.background = double(background);
  field.bounds = {origin, origin + dims};
  std::vector<T> out;
  out.reserve(size_t(dims.x) * size_t(dims.y) * size_t(dims.z));
  const Vec3i first = leafOriginOf(origin);
  for (int z = first.z; z < field.bounds.hi.z; z += kLeafEdge)
    for (int y = first.y; y < field.bounds.hi.y; y += kLeafEdge)
      for (int x = first.x; x < field.bounds.hi.x; x += kLeafEdge) {
        T leaf[kLeafVoxels];
        std::fill(leaf, leaf + kLeafVoxels, background);
        const VoxelBox part{componentMax({x, y, z}, origin),
                            componentMin({x + kLeafEdge, y + kLeafEdge, z + kLeafEdge}, field.bounds.hi)};
        for (int vz = part.lo.z; vz < part.hi.z; ++vz)
          for (int vy = part.lo.y; vy < part.hi.y; ++vy) {
            const Vec3i v = Vec3i{part.lo.x, vy, vz} - origin;
            std::memcpy(leaf + leafOffset(part.lo.x - x, vy - y, vz - z),
                        values + (int64_t(v.z) * dims.y + v.y) * dims.x + v.x,
                        size_t(part.hi.x - part.lo.x) * sizeof(T));
          }
        if (std::all_of(leaf, leaf + kLeafVoxels, [&](T v) { return bitsOf(v) == bitsOf(background); }))
          continue;
        field.leafOrigins.push_back({x, y, z});
        out.insert(out.end(), leaf, leaf + kLeafVoxels);
      }
  field.values = std::move(out);
  return field;
}

template Field fieldFromDense(const uint8_t*, const Vec3i&, uint8_t, const Vec3i&);
template Field fieldFromDense(const uint16_t*, const Vec3i&, uint16_t, const Vec3i&);
template Field fieldFromDense(const float*, const Vec3i&, float, const Vec3i&);

uint64_t voxelChecksum(const Vec3i& v, uint64_t valueBits, uint64_t backgroundBits) {
  return checksumTerm(checksumOfPlace(v), valueBits, backgroundBits);
}

uint64_t stateChecksum(const Field& field) {
  return std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        const uint64_t background = bitsOf(T(field.background));
        uint64_t sum = 0;
        for (size_t leaf = 0; leaf < field.leafCount(); ++leaf)
          for (int i = 0; i < kLeafVoxels; ++i) {
            const Vec3i v = field.leafOrigins[leaf] + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
            sum +=
                checksumTerm(checksumOfPlace(v), bitsOf(values[leaf * kLeafVoxels + size_t(i)]), background);
          }
        return sum;
      },
      field.values);
}

FieldStatistics fieldStatistics(const Field& field) {
  return std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        const T background = T(field.background);
        T lo = isFiniteValue(background) ? background : T(0), hi = lo;
        int64_t nonFinite = 0;
        for (T v : values) {
          if (!isFiniteValue(v)) {
            ++nonFinite;
            continue;
          }
          lo = std::min(lo, v);
          hi = std::max(hi, v);
        }
        return FieldStatistics{double(lo), double(hi), nonFinite};
      },
      field.values);
}

}  // namespace kairos
