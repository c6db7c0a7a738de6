// How wrong slabs of a given length are in one brick.
#pragma once

#include <array>

#include "core/transfer_function.h"
#include "volume/brick_volume.h"

namespace kairos {

/// Root-mean-square errors of a ray's partial through a brick, per channel, by the slabs' length.
class SlabErrors {
 public:
  /// Lengths 2, 4, 8 and 16 voxels are measured along rows of voxels.
  static constexpr int kMeasured = 4;
  explicit SlabErrors(const std::array<double, kMeasured>& measured) : measured_(measured) {}

  /// Below two voxels, where rows of voxels tell nothing, the error is taken to fall with the length: slower
  /// than the second order it has where the field is smooth, for the kinks of trilinear fields and the edges
  /// of transfer functions.
  double at(double voxels) const;

 private:
  std::array<double, kMeasured> measured_;
};

/// Measures them: along rows of voxels the interpolated field is linear from voxel to voxel, so slabs one
/// voxel long are exact, and longer ones, which pass voxels over, show their error.
class SlabErrorMeter {
 public:
  /// `latticeStep`: voxels the table's densities are meant over. The table must outlive the object.
  SlabErrorMeter(const ClassificationTable& table, double latticeStep);

  /// Errors in the cell of a volume.
  SlabErrors measure(const BrickVolume& volume, uint32_t cell) const;

 private:
  struct Densities {
    const ClassificationTable::DensityInterval* densities;
    float integralUnit, rangeLo, scale, lastNode;
  };
  static constexpr int kRowSlabs = kBrickEdge;
  using Row = std::array<float, kRowSlabs + 1>;
  using Partial = std::array<float, 4>;

  using Squares = std::array<double, SlabErrors::kMeasured>;

  Partial integrate(const float* values, int slabs, bool corrected) const;
  void compare(const Row& row, Squares& squares) const;
  template <class T>
  SlabErrors measureBrick(const BrickVolume& volume, uint32_t cell) const;

  const ClassificationTable& visible_;
  Densities table_;
  float voxel_;  // in lattice steps
};

}  // namespace kairos
