// The render-side volume: a sparse grid of bricks, updated in place from changed voxels.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "core/transfer_function.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

/// A brick owns 16^3 voxels and copies the 4 that follow on each axis (the apron), so that whatever footprint
/// starts in the 16^3 and spans up to 5 voxels is read from one brick. Voxel (x, y, z) of a brick, 0 <= x, y,
/// z < 20, stands at x + 20 y + 400 z.
inline constexpr int kBrickEdge = 16;
inline constexpr int kBrickApron = 4;
inline constexpr int kBrickStride = kBrickEdge + kBrickApron;
inline constexpr int kBrickVoxels = kBrickStride * kBrickStride * kBrickStride;

/// A sub-block is 5^3 of a brick's 20^3 voxels; bit bx + 4 by + 16 bz of a 64-bit mask stands for one.
inline constexpr int kSubBlockEdge = 5;

/// A window is the part of a brick that footprints starting in one 4^3 block of its 16^3 voxels can read: 8^3
/// voxels from the block's first. Window bx + 4 by + 16 bz belongs to block (bx, by, bz).
inline constexpr int kWindowBlock = 4;
inline constexpr int kWindows = 64;

/// Cells of a brick grid are numbered x fastest.
inline uint32_t cellIndex(const Vec3i& cell, const Vec3i& gridSize) {
  return uint32_t((cell.z * gridSize.y + cell.y) * gridSize.x + cell.x);
}
inline Vec3i cellCoordinates(uint32_t cell, const Vec3i& gridSize) {
  const auto x = int32_t(cell % uint32_t(gridSize.x)), rest = int32_t(cell / uint32_t(gridSize.x));
  return {x, rest % gridSize.y, rest / gridSize.y};
}

/// The bricks a set of changes touched, aprons included, in ascending cell order.
struct DirtyBricks {
  std::vector<uint32_t> cells;
  std::vector<uint64_t> subBlocks;  // which sub-blocks of each received new values
  std::vector<uint64_t> windows;    // which windows of each did; may say so of more
};

struct LeafView;

/// Bricks of one element type over a fixed domain. A cell is a place in the brick grid; cells whose brick and
/// apron hold nothing but the background share one brick. NaN and infinities are stored as the background
/// ("absent").
/// Around dense data one layer of voxels repeats the outermost (Lattice::sourceOf). Reading is safe from
/// several threads; `apply` is not concurrent with it.
class BrickVolume {
 public:
  BrickVolume(const Lattice& lattice, const Field& field, ThreadPool& pool);
  ~BrickVolume();
  BrickVolume(BrickVolume&&) noexcept;

  const Lattice& lattice() const { return lattice_; }
  /// The finite value that stands for "nothing here".
  double background() const { return background_; }

  /// Voxel index of the first voxel of cell (0, 0, 0); cells lie at multiples of 16 from it.
  Vec3i gridOrigin() const { return gridOrigin_; }
  Vec3i gridSize() const { return gridSize_; }
  uint32_t cellCount() const { return uint32_t(bricks_.size()); }
  Vec3i cellCoordinates(uint32_t cell) const { return kairos::cellCoordinates(cell, gridSize_); }
  /// Voxel index of the cell's first voxel.
  Vec3i cellOrigin(uint32_t cell) const { return gridOrigin_ + cellCoordinates(cell) * kBrickEdge; }
  uint32_t cellIndex(const Vec3i& coordinates) const { return kairos::cellIndex(coordinates, gridSize_); }

  /// The 20^3 values of a cell; never null.
  template <class T>
  const T* brick(uint32_t cell) const {
    return static_cast<const T*>(bricks_[cell]);
  }
  const std::vector<const void*>& brickPointers() const { return bricks_; }
  /// Range of a cell's values, apron included.
  ValueRange range(uint32_t cell) const { return ranges_[cell]; }
  /// Ranges of the cell's 64 windows.
  std::array<ValueRange, kWindows> windowRanges(uint32_t cell) const;
  bool isBackground(uint32_t cell) const { return bricks_[cell] == backgroundBrick_; }

  /// Writes the new values into every brick and apron that holds them, and refreshes value ranges in the same
  /// pass. Throws StateError for another element type or a voxel outside the domain; the volume is then
  /// unchanged. The result is valid until the next call.
  const DirtyBricks& apply(const ChangedVoxels& changes, ThreadPool& pool);

  uint64_t memoryBytes() const;
  uint32_t allocatedBricks() const;

 private:
  class Pool;

  void scatter(const void* valuesEnd, ThreadPool& pool);
  void sortByCell();
  template <class T>
  void updateBrick(size_t group, const void* valuesEnd);

  Lattice lattice_;
  double background_;
  Vec3i gridOrigin_, gridSize_;
  std::unique_ptr<Pool> pool_;
  const void* backgroundBrick_;
  std::vector<const void*> bricks_;
  std::vector<ValueRange> ranges_;

  // Scratch of `scatter`, kept so that a steady state allocates nothing.
  std::vector<uint32_t> leavesOfCells_;  // numbers of leaves, dirty cell by dirty cell
  std::vector<uint32_t> groupBegin_;     // where each dirty cell's begin
  std::vector<uint32_t> leafCount_;      // per cell of the grid; 0 between updates
  std::vector<LeafView> leafViews_;
  DirtyBricks dirty_;
};

}  // namespace kairos
