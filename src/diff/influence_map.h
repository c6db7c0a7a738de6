// Influence numbers: how many changed voxels influence each pixel (Liao, Lai and Chung 2004, definition 2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/parallel.h"
#include "diff/voxel_projection.h"
#include "volume/changed_voxels.h"

namespace kairos {

/// I(r, s) = |{changed voxels whose J holds (r, s)}| of every pixel, row by row, top row first; a pixel is
/// changed when it is above 0. Voxels can be added and taken away again, so that a map follows the set of
/// changed voxels from step to step. Counts do not depend on the number of threads.
///
/// A voxel costs one projection and four numbers of a table of differences (two per row where J is no
/// rectangle), however many pixels it covers; `refresh` sums the table up once per step.
class InfluenceMap {
 public:
  InfluenceMap(const VoxelProjection& projection, ThreadPool& pool);

  /// All voxels gone.
  void clear();
  void add(std::span<const ChangedLeaf> voxels) { accumulate(voxels, 1); }
  void remove(std::span<const ChangedLeaf> voxels) { accumulate(voxels, -1); }
  /// Brings `numbers` up to date with what was added and removed.
  void refresh();

  std::span<const int32_t> numbers() const { return numbers_; }
  uint64_t memoryBytes() const { return (differences_.size() + numbers_.size()) * sizeof(int32_t); }
  int width() const { return projection_.width(); }
  int height() const { return projection_.height(); }

 private:
  // Rows [begin, end) of the image, which one thread fills.
  struct Band {
    int begin, end;
  };
  struct Rows {
    int first, last;
  };

  void accumulate(std::span<const ChangedLeaf> voxels, int32_t sign);
  void accumulateLeaf(const ChangedLeaf& leaf, const Band& band, int32_t sign, PixelRows& rows);
  void addRectangle(const PixelRectangle& j, const Band& band, int32_t sign);
  void addRows(const PixelRows& j, const Band& band, int32_t sign);
  int32_t* differences(int row) { return differences_.data() + size_t(row) * size_t(stride_); }

  VoxelProjection projection_;
  ThreadPool& pool_;
  int stride_;
  std::vector<Band> bands_;
  // With rectangles, element (x, y) is the number's difference to those left of, above, and left above it
  // within the band; otherwise to the one left of it.
  std::vector<int32_t> differences_;
  std::vector<int32_t> numbers_;
  std::vector<Rows> leafRows_;  // scratch: the rows each leaf can influence
};

/// The numbers as an image of one channel.
Image imageOf(std::span<const int32_t> numbers, int width, int height);

/// Element n is how many pixels have influence number n (the paper's figures 5, 8 and 11).
std::vector<uint64_t> influenceHistogram(std::span<const int32_t> numbers);

}  // namespace kairos
