// Which parts of an image a frame has to find anew.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace kairos {

/// The image is refined in blocks of 8x8 pixels: 2x2 tiles of the exact image.
inline constexpr int kBlockEdge = 8;

/// Neighbouring blocks of one row of blocks: [first, last).
struct BlockRun {
  int row, first, last;
};

/// Flags of blocks, and their runs.
class BlockSet {
 public:
  BlockSet(int imageWidth, int imageHeight)
      : columns_((imageWidth + kBlockEdge - 1) / kBlockEdge),
        rows_((imageHeight + kBlockEdge - 1) / kBlockEdge),
        flags_(size_t(columns_) * size_t(rows_), 0) {}

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  size_t size() const { return flags_.size(); }
  bool contains(size_t block) const { return flags_[block] != 0; }
  bool contains(int column, int row) const { return contains(index(column, row)); }
  size_t index(int column, int row) const { return size_t(row) * size_t(columns_) + size_t(column); }
  /// The block that holds a pixel.
  size_t blockAt(int x, int y) const { return index(x / kBlockEdge, y / kBlockEdge); }
  void set(size_t block, bool in) { flags_[block] = in; }
  size_t count() const { return size_t(std::count(flags_.begin(), flags_.end(), uint8_t(1))); }
  void clear() { flags_.assign(flags_.size(), 0); }

  std::vector<BlockRun> runs() const {
    std::vector<BlockRun> runs;
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        if (!contains(column, row)) continue;
        const int first = column;
        while (column < columns_ && contains(column, row)) ++column;
        runs.push_back({row, first, column});
      }
    return runs;
  }

 private:
  int columns_, rows_;
  std::vector<uint8_t> flags_;
};

}  // namespace kairos
