#include "io/series.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

namespace kairos::test {
namespace {

constexpr int64_t kFirstStep = 21;

template <class T>
T valueOf(double v, int x, int y, int t) {
  if constexpr (std::is_same_v<T, float>) {
    if (x == 9 && y == 9) return std::bit_cast<float>(0x7fc00000u + uint32_t(t));
    if (x == 9 && y == 10) return t % 2 ? -0.0f : std::numeric_limits<float>::infinity();
    return float(v * 0.123);
  } else {
    return T(v * double(std::numeric_limits<T>::max()));
  }
}

template <class T>
Field blobAt(int t, int edge) {
  std::vector<T> values(size_t(edge) * edge * edge);
  const double unit = edge / 24.0, centre = (5 + 1.7 * t) * unit, radius = (6 + 2 * std::sin(t)) * unit;
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      for (int x = 0; x < edge; ++x) {
        const double d = std::hypot(x - centre, y - 10 * unit, z - 9 * unit) / radius;
        if (d < 1) values[size_t((z * edge + y) * edge + x)] = valueOf<T>(1 - d, x, y, t);
      }
  return fieldFromDense(values.data(), {edge, edge, edge}, T(0), {-3, 5, -11});
}

template <class T>
uint64_t bits(T v) {
  uint64_t b = 0;
  std::memcpy(&b, &v, sizeof v);
  return b;
}

template <class T>
T valueAt(const Field& field, int64_t leaf, int offset) {
  return leaf < 0 ? T(field.background)
                  : valuesAs<T>(field.values)[size_t(leaf) * kLeafVoxels + size_t(offset)];
}

struct LessZYX {
  bool operator()(const Vec3i& a, const Vec3i& b) const { return lessZYX(a, b); }
};

}  // namespace

std::vector<Field> movingBlob(ElementType type, int count, int edge) {
  std::vector<Field> fields;
  for (int t = 0; t < count; ++t)
    fields.push_back(dispatch(type, [&]<class T>() { return blobAt<T>(t, edge); }));
  return fields;
}

ChangedVoxels changesBetween(const Field& before, const Field& after) {
  std::set<Vec3i, LessZYX> origins(before.leafOrigins.begin(), before.leafOrigins.end());
  origins.insert(after.leafOrigins.begin(), after.leafOrigins.end());
  ChangedVoxels changes;
  changes.values = makeVoxelArray(after.type());
  dispatch(after.type(), [&]<class T>() {
    auto& values = valuesAs<T>(changes.values);
    for (const Vec3i& origin : origins) {
      ChangedLeaf leaf{origin, {}, values.size()};
      const int64_t a = before.findLeaf(origin), b = after.findLeaf(origin);
      for (int i = 0; i < kLeafVoxels; ++i) {
        if (bits(valueAt<T>(before, a, i)) == bits(valueAt<T>(after, b, i))) continue;
        leaf.mask[size_t(i / 64)] |= uint64_t(1) << (i % 64);
        values.push_back(valueAt<T>(after, b, i));
      }
      if (leaf.count() > 0) changes.leaves.push_back(leaf);
    }
  });
  changes.stateBefore = stateChecksum(before);
  changes.stateAfter = stateChecksum(after);
  return changes;
}

bool sameState(const Field& a, const Field& b) {
  return a.type() == b.type() && a.background == b.background && changesBetween(a, b).empty();
}

SequenceManifest manifestFor(const std::vector<Field>& fields) {
  SequenceManifest manifest;
  manifest.lattice.type = fields.front().type();
  manifest.lattice.dense = true;
  manifest.lattice.worldFromIndex = Affine::scale({0.1, 0.2, 0.3});
  manifest.lattice.worldFromIndex.column[1].x = 1.0 / 3;
  manifest.lattice.worldFromIndex.translation = {1.0 / 7, -2, 3};
  manifest.gridName = "density";
  for (size_t i = 0; i < fields.size(); ++i) {
    manifest.lattice.domain = unite(manifest.lattice.domain, fields[i].bounds);
    manifest.inputs.push_back("f" + std::to_string(i) + ".raw");
  }
  return manifest;
}

SequenceStep entryFor(const Field& field, int64_t step, const ChangedVoxels* changes) {
  const FieldStatistics statistics = fieldStatistics(field);
  SequenceStep entry;
  entry.step = step;
  entry.changedVoxels = changes ? changes->count() : 0;
  entry.stateChecksum = stateChecksum(field);
  entry.range = {float(statistics.lo), float(statistics.hi)};
  entry.nonFinite = statistics.nonFinite;
  return entry;
}

void writeSteps(SequenceWriter& writer, const std::vector<Field>& fields, size_t from, size_t to,
                int keyEvery) {
  for (size_t i = from; i < to; ++i) {
    const bool key = i == 0 || (keyEvery > 0 && i % size_t(keyEvery) == 0);
    const ChangedVoxels changes = i > 0 ? changesBetween(fields[i - 1], fields[i]) : ChangedVoxels{};
    const ChangedVoxels* given = i > 0 ? &changes : nullptr;
    writer.write(entryFor(fields[i], kFirstStep + int64_t(i), given), key ? &fields[i] : nullptr, given);
  }
}

void writeSequence(const std::string& directory, const std::vector<Field>& fields, int keyEvery) {
  SequenceManifest manifest = manifestFor(fields);
  manifest.keyEvery = keyEvery;
  SequenceWriter writer(directory, manifest, false);
  writeSteps(writer, fields, 0, fields.size(), keyEvery);
  writer.finish();
}

}  // namespace kairos::test
