#include "raycast/slab_error.h"

#include <algorithm>
#include <cmath>

#include "raycast/scalar_slabs.h"

namespace kairos {

double SlabErrors::at(double voxels) const {
  if (voxels < 2) return measured_[0] * (voxels / 2);
  const int i = std::clamp(int(std::lround(std::log2(voxels))) - 1, 0, kMeasured - 1);
  return measured_[size_t(i)];
}

SlabErrorMeter::SlabErrorMeter(const ClassificationTable& table, double latticeStep)
    : visible_(table),
      table_{table.densities().data(), table.integralUnit(), table.range().lo, table.scale(),
             float(table.nodeCount() - 1)},
      voxel_(float(1 / latticeStep)) {}

// The partial of a row cut into slabs: emission and absorption of all slabs, attenuated as if they were
// mixed.
SlabErrorMeter::Partial SlabErrorMeter::integrate(const float* values, int slabs, bool corrected) const {
  const auto end = [&](int i) {
    float v = values[i];
    if (corrected && slabs > 1) {
      const int at = std::clamp(i, 1, slabs - 1);
      v -= kCurvature * (values[at - 1] - 2 * values[at] + values[at + 1]);
    }
    return slabEnd(table_, v);
  };
  Partial total{};
  SlabEnd<float> before = end(0);
  const float width = voxel_ * float(kRowSlabs) / float(slabs);
  for (int i = 1; i <= slabs; ++i) {
    const SlabEnd<float> behind = end(i);
    const auto [sum, reach] = slabSum(table_, before, behind);
    for (size_t c = 0; c < 4; ++c) total[c] += sum[c] * (width / reach);
    before = behind;
  }
  const float depth = total[3];
  const float share = depth > 1e-6f ? -std::expm1(-depth) / depth : 1;
  for (float& t : total) t *= share;
  return total;
}

namespace {

constexpr int kStride[3] = {1, kBrickStride, kBrickStride* kBrickStride};
constexpr int kFaceEdge = kBrickEdge + 1;  // voxels, those of the next brick's face included
constexpr int kRows = 3 * kFaceEdge * kFaceEdge;

// The voxels of a brick that rays can read, all ends included; around dense data lie others, which would look
// like an edge.
struct Readable {
  Vec3i lo, hi;
  Readable(const BrickVolume& volume, uint32_t cell) {
    const PointBox box = volume.lattice().samplingBox();
    const Vec3i origin = volume.cellOrigin(cell);
    for (int a = 0; a < 3; ++a) {
      lo[a] = int(std::clamp(std::floor(box.lo[a]) - origin[a], 0.0, double(kBrickEdge)));
      hi[a] = int(std::clamp(std::ceil(box.hi[a]) - origin[a], double(lo[a]), double(kBrickEdge)));
    }
  }
};

// Row number `row` of a brick: along each axis in turn, from every voxel of the brick's face. Its values
// repeat where nothing is readable; a row that is not readable at all has an empty range.
template <class T, class Row>
ValueRange takeRow(const T* brick, const Readable& readable, int row, Row& values) {
  const int axis = row / (kFaceEdge * kFaceEdge), p = row / kFaceEdge % kFaceEdge, q = row % kFaceEdge;
  const int second = (axis + 1) % 3, third = (axis + 2) % 3;
  if (p < readable.lo[second] || p > readable.hi[second] || q < readable.lo[third] || q > readable.hi[third])
    return {0, 0};
  const T* first = brick + p * kStride[second] + q * kStride[third];
  T lo = first[readable.lo[axis] * kStride[axis]], hi = lo;
  for (size_t i = 0; i < values.size(); ++i) {
    const T v = first[std::clamp(int(i), readable.lo[axis], readable.hi[axis]) * kStride[axis]];
    lo = std::min(lo, v);
    hi = std::max(hi, v);
    values[i] = float(v);
  }
  return {float(lo), float(hi)};
}

}  // namespace

// Adds a row's squared errors.
void SlabErrorMeter::compare(const Row& row, Squares& squares) const {
  const Partial exact = integrate(row.data(), kRowSlabs, false);
  for (size_t l = 0; l < squares.size(); ++l) {
    const int slabs = kRowSlabs >> (l + 1);
    Row coarse;
    for (int i = 0; i <= slabs; ++i) coarse[size_t(i)] = row[size_t(i << (l + 1))];
    const Partial found = integrate(coarse.data(), slabs, true);
    for (size_t c = 0; c < 4; ++c) squares[l] += double((found[c] - exact[c]) * (found[c] - exact[c])) / 4;
  }
}

template <class T>
SlabErrors SlabErrorMeter::measureBrick(const BrickVolume& volume, uint32_t cell) const {
  const T* brick = volume.brick<T>(cell);
  const Readable readable(volume, cell);
  // All rows that can be seen are found, so that none of a few is missed; of many, some are measured.
  std::array<uint16_t, kRows> seen;
  int count = 0;
  Row row;
  for (int r = 0; r < kRows; ++r) {
    const ValueRange range = takeRow(brick, readable, r, row);
    if (range.lo != range.hi && visible_.visible(range.lo, range.hi)) seen[size_t(count++)] = uint16_t(r);
  }
  constexpr int kMeasuredRows = 48;
  const int measured = std::min(count, kMeasuredRows);
  Squares squares{};
  for (int m = 0; m < measured; ++m) {
    takeRow(brick, readable, seen[size_t((m * count + count / 2) / measured)], row);
    compare(row, squares);
  }
  for (double& s : squares) s = measured > 0 ? std::sqrt(s / measured * count / kRows) : 0;
  return SlabErrors(squares);
}

SlabErrors SlabErrorMeter::measure(const BrickVolume& volume, uint32_t cell) const {
  return dispatch(volume.lattice().type, [&]<class T>() { return measureBrick<T>(volume, cell); });
}

}  // namespace kairos
