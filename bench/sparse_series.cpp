// Writes a large, sparse simulation to try the program on: balls of smooth noise in a box that is otherwise
// empty, a few of which change from step to step.
//
//     sparse_series DIR EDGE CONTENT STEPS
//
// DIR/sparse_0000.vdb ... hold one float grid "density" over EDGE^3 voxels. The balls fill 2 % of CONTENT^3
// voxels around the middle of the box, so the same content can be had in a larger box: two voxels at opposite
// corners mark the box.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "io/atomic_file.h"
#include "io/vdb_writer.h"

namespace {

using namespace kairos;

constexpr double kActiveShare = 0.02;
constexpr int kBalls = 96;
constexpr int kBallsAStep = 5;  // that change

struct LessZYX {
  bool operator()(const Vec3i& a, const Vec3i& b) const { return lessZYX(a, b); }
};
using Leaves = std::map<Vec3i, std::vector<float>, LessZYX>;

// A well-mixed number in [0, 1) for each ball and purpose.
double uniform(uint32_t ball, uint32_t purpose) {
  uint64_t x = (uint64_t(ball) << 32 | purpose) + 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return double((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

float& voxel(Leaves& leaves, const Vec3i& v) {
  std::vector<float>& leaf = leaves[leafOriginOf(v)];
  if (leaf.empty()) leaf.assign(kLeafVoxels, 0.0f);
  const Vec3i local = v - leafOriginOf(v);
  return leaf[size_t(leafOffset(local.x, local.y, local.z))];
}

void addBall(Leaves& leaves, const Vec3d& centre, double radius, double phase) {
  const Vec3i lo(Vec3d(centre - Vec3d{radius, radius, radius})),
      hi(Vec3d(centre + Vec3d{radius, radius, radius}));
  for (int z = lo.z; z <= hi.z; ++z)
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x) {
        const double r = length(Vec3d(Vec3i{x, y, z}) - centre) / radius;
        if (r >= 1) continue;
        const double waves = std::sin(0.2 * x + phase) * std::sin(0.23 * y - phase) * std::sin(0.17 * z);
        voxel(leaves, {x, y, z}) = float((1 - r * r) * (0.6 + 0.4 * waves) + 1e-3);
      }
}

Field step(int edge, int content, int number) {
  const double volume = kActiveShare * std::pow(content, 3) / kBalls,
               radius = std::cbrt(volume * 3 / (4 * 3.14159265));
  Leaves leaves;
  for (uint32_t ball = 0; ball < kBalls; ++ball) {
    const auto place = [&](uint32_t axis) {
      return 0.5 * edge - 0.5 * content + radius + uniform(ball, axis) * (content - 2 * radius);
    };
    // A ball's phase is that of the last step in which it was its turn.
    const int turns = (number * kBallsAStep + kBalls - 1 - int(ball)) / kBalls;
    addBall(leaves, {place(0), place(1), place(2)}, radius, 6.28 * uniform(ball, 3) + 0.5 * turns);
  }
  voxel(leaves, {0, 0, 0}) = voxel(leaves, {edge - 1, edge - 1, edge - 1}) = 1e-3f;
  Field field;
  std::vector<float> values;
  for (const auto& [origin, leaf] : leaves) {
    field.leafOrigins.push_back(origin);
    values.insert(values.end(), leaf.begin(), leaf.end());
  }
  field.values = std::move(values);
  return field;
}

void write(const std::string& directory, int edge, int content, int steps) {
  Lattice lattice;
  lattice.type = ElementType::f32;
  lattice.domain = {{0, 0, 0}, {edge, edge, edge}};
  makeWritableDirectory(directory);
  for (int number = 0; number < steps; ++number) {
    char name[32];
    std::snprintf(name, sizeof name, "/sparse_%04d.vdb", number);
    writeFileAtomically(directory + name, vdbFromField(step(edge, content, number), lattice, "density", {}));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fputs("usage: sparse_series DIR EDGE CONTENT STEPS\n", stderr);
    return 2;
  }
  try {
    write(argv[1], std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4]));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sparse_series: %s\n", error.what());
    return 1;
  }
}
