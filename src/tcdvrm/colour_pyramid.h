// An image at several resolutions, filled in from coarse to fine.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/parallel.h"
#include "tcdvrm/detail_blend.h"
#include "tcdvrm/float4.h"
#include "tcdvrm/live_blocks.h"

namespace kairos {

/// A grid of RGBA nodes; node (i, j) is the pixel (stride * i, stride * j).
struct NodeGrid {
  float* data = nullptr;
  int columns = 0, rows = 0, stride = 1;

  float* node(int i, int j) const { return data + (size_t(j) * size_t(columns) + size_t(i)) * 4; }
  /// Beyond the edges the outermost nodes repeat.
  float* nearest(int i, int j) const;
};

/// Grids of the strides 16, 8, 4, 2 and 1, the last being the image. Between frames those of the strides 1, 2
/// and 4 show the image. During a frame a grid's nodes are known where they were cast; `interpolate` finds
/// the others of one stride from the next coarser: a cubic along columns, then rows, plus a share of the
/// detail that the previous image had there (DetailBlend). Only live blocks are ever written.
class ColourPyramid {
 public:
  static constexpr int kLevels = 5;  // level k has stride 2^k
  struct NodeRange {
    int begin, end;
  };

  ColourPyramid(Image& image, ThreadPool& pool);

  const NodeGrid& grid(int level) const { return grids_[size_t(level)]; }
  /// Makes the grids from `level` on show the image, or what the next finer grid does.
  void takeImage(int level = 1);
  /// Copies one pixel of the image, which somebody else wrote, to every grid that has it.
  void takePixel(int x, int y);
  /// Somebody else wrote pixels of a block that are on no coarser grid.
  void takeFinePixels(size_t block) { blank_[block] = 0; }

  /// Keeps what the image shows before the frame's first node is written: only when blending.
  void keepOld(std::span<const BlockRun> runs);
  /// Finds the nodes of a level, 0 or 1 where blended, from the next coarser.
  void interpolate(int level, std::span<const BlockRun> runs, const DetailBlend* blend);

  /// The cubic through the nodes at -3, -1, 1 and 3 times `reach` from node (i, j), in its row or column.
  static Float4 cubicAlongRow(const NodeGrid& grid, int i, int j, int reach);
  static Float4 cubicAlongColumn(const NodeGrid& grid, int i, int j, int reach);
  /// The cubic half-way between node (i, j) and the next one of its row or column.
  static Float4 cubicAfterColumn(const NodeGrid& grid, int i, int j);
  static Float4 cubicAfterRow(const NodeGrid& grid, int i, int j);

 private:
  template <class Body>
  void forLambdas(int level, NodeRange columns, int j, const DetailBlend* blend, Body&& body);
  bool coarseBlank(int row, int column) const;
  std::vector<BlockRun> clearBlank(const BlockRun& run);
  void clearBlock(int row, int column);
  void interpolateRun(int level, const BlockRun& run, const DetailBlend* blend, std::vector<float>& line);
  void interpolateRow(int level, NodeRange columns, int j, float lambda, std::vector<float>& line);

  ThreadPool& pool_;
  BlockSet blocks_;             // an empty one of the image's size
  std::vector<uint8_t> blank_;  // blocks of the image that are known to be all zero
  std::array<NodeGrid, kLevels> grids_;
  std::array<std::vector<float>, kLevels> storage_;
  std::array<std::vector<float>, 3> old_;  // levels 1 and 2, as they were when the frame began
};

}  // namespace kairos
