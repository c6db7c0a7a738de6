#include "tcdvrm/colour_pyramid.h"

#include <algorithm>

#include "tcdvrm/interpolation_rows.h"

namespace kairos {
namespace {

// The four rows of the coarser grid around odd row j of the next finer one, from a node on; beyond the edges
// the outermost.
struct RowsAround {
  const float* at[4];
  RowsAround(const NodeGrid& coarse, int column, int j) {
    for (int r = 0; r < 4; ++r) at[r] = coarse.node(column, std::clamp(j / 2 - 1 + r, 0, coarse.rows - 1));
  }
};

ColourPyramid::NodeRange columnsOf(const BlockRun& run, const NodeGrid& grid) {
  return {(run.first * kBlockEdge + grid.stride - 1) / grid.stride,
          std::min((run.last * kBlockEdge + grid.stride - 1) / grid.stride, grid.columns)};
}

ColourPyramid::NodeRange rowsOf(const BlockRun& run, const NodeGrid& grid) {
  return {(run.row * kBlockEdge + grid.stride - 1) / grid.stride,
          std::min(((run.row + 1) * kBlockEdge + grid.stride - 1) / grid.stride, grid.rows)};
}

}  // namespace

float* NodeGrid::nearest(int i, int j) const {
  return node(std::clamp(i, 0, columns - 1), std::clamp(j, 0, rows - 1));
}

ColourPyramid::ColourPyramid(Image& image, ThreadPool& pool)
    : pool_(pool), blocks_(image.width, image.height), blank_(blocks_.size(), 0) {
  grids_[0] = {image.data.data(), image.width, image.height, 1};
  for (size_t level = 1; level < grids_.size(); ++level) {
    NodeGrid& grid = grids_[level];
    grid.stride = 1 << level;
    grid.columns = (image.width - 1) / grid.stride + 1;
    grid.rows = (image.height - 1) / grid.stride + 1;
    storage_[level].assign(size_t(grid.columns) * size_t(grid.rows) * 4, 0.0f);
    grid.data = storage_[level].data();
  }
  // Not when they are first needed: touching new memory takes a frame's time.
  for (const size_t level : {1, 2}) old_[level] = storage_[level];
}

void ColourPyramid::takeImage(int level) {
  if (level == 1) std::fill(blank_.begin(), blank_.end(), uint8_t(0));
  for (; level < kLevels; ++level) {
    const NodeGrid &g = grid(level), &finer = grid(level - 1);
    for (int j = 0; j < g.rows; ++j)
      for (int i = 0; i < g.columns; ++i) store4(g.node(i, j), load4(finer.node(2 * i, 2 * j)));
  }
}

void ColourPyramid::takePixel(int x, int y) {
  const Float4 colour = load4(grids_[0].node(x, y));
  blank_[blocks_.blockAt(x, y)] = 0;
  for (size_t level = 1; level < grids_.size() && ((x | y) & (grids_[level].stride - 1)) == 0; ++level)
    store4(grids_[level].node(x >> level, y >> level), colour);
}

void ColourPyramid::keepOld(std::span<const BlockRun> runs) {
  if (runs.empty()) return;
  BlockRun box = runs.front();  // of columns
  for (const BlockRun& run : runs) box = {0, std::min(box.first, run.first), std::max(box.last, run.last)};
  for (const int level : {1, 2}) {
    const NodeGrid& g = grid(level);
    std::vector<float>& old = old_[size_t(level)];
    const int nodes = kBlockEdge / g.stride, reach = 4;  // of an interpolation
    const int begin = std::max(box.first * nodes - reach, 0);
    const int end = std::min(box.last * nodes + reach, g.columns);
    const int top = std::max(runs.front().row * nodes - reach, 0);
    const int bottom = std::min((runs.back().row + 1) * nodes + reach, g.rows);
    for (int j = top; j < bottom; ++j)
      std::copy(g.node(begin, j), g.node(begin, j) + size_t(end - begin) * 4,
                old.data() + (g.node(begin, j) - g.data));
  }
}

void ColourPyramid::interpolate(int level, std::span<const BlockRun> runs, const DetailBlend* blend) {
  pool_.forEach(runs.size(), 8, [&](size_t begin, size_t end) {
    std::vector<float> line;
    for (size_t r = begin; r < end; ++r) {
      if (level > 0) {
        interpolateRun(level, runs[r], blend, line);
        continue;
      }
      for (const BlockRun& part : clearBlank(runs[r])) interpolateRun(level, part, blend, line);
    }
  });
}

// Are all nodes of stride 2 zero that the pixels of a block are interpolated from?
bool ColourPyramid::coarseBlank(int row, int column) const {
  constexpr int kNodes = kBlockEdge / 2;
  const NodeGrid& coarse = grid(1);
  const int left = std::max(column * kNodes - 1, 0);
  const int right = std::min((column + 1) * kNodes + 2, coarse.columns);
  const int top = std::max(row * kNodes - 1, 0), bottom = std::min((row + 1) * kNodes + 2, coarse.rows);
  for (int j = top; j < bottom; ++j) {
    Float4 largest = {0, 0, 0, 0};
    for (int i = left; i < right; ++i) {
      const Float4 node = load4(coarse.node(i, j));
      largest = node > largest ? node : largest;
    }
    if (sum4(largest) > 0) return false;
  }
  return true;
}

// Makes the blocks of a run zero that lie among nothing but zeros, whatever detail they had. Returns the
// others.
std::vector<BlockRun> ColourPyramid::clearBlank(const BlockRun& run) {
  std::vector<BlockRun> others;
  for (int column = run.first; column < run.last; ++column) {
    uint8_t& blank = blank_[blocks_.index(column, run.row)];
    if (coarseBlank(run.row, column)) {
      if (!blank) clearBlock(run.row, column);
      blank = 1;
      continue;
    }
    blank = 0;
    if (!others.empty() && others.back().last == column)
      ++others.back().last;
    else
      others.push_back({run.row, column, column + 1});
  }
  return others;
}

void ColourPyramid::clearBlock(int row, int column) {
  const NodeGrid& g = grid(0);
  const int begin = column * kBlockEdge, end = std::min(begin + kBlockEdge, g.columns);
  for (int j = row * kBlockEdge; j < std::min((row + 1) * kBlockEdge, g.rows); ++j)
    std::fill(g.node(begin, j), g.node(begin, j) + size_t(end - begin) * 4, 0.0f);
}

void ColourPyramid::interpolateRun(int level, const BlockRun& run, const DetailBlend* blend,
                                   std::vector<float>& line) {
  const NodeRange rows = rowsOf(run, grid(level)), columns = columnsOf(run, grid(level));
  for (int j = rows.begin; j < rows.end; ++j)
    forLambdas(level, columns, j, blend,
               [&](NodeRange part, float lambda) { interpolateRow(level, part, j, lambda, line); });
}

// Calls body(part, lambda) for parts of the range that share a lambda.
template <class Body>
void ColourPyramid::forLambdas(int level, NodeRange columns, int j, const DetailBlend* blend, Body&& body) {
  if (!blend) return body(columns, 0.0f);
  const int stride = grid(level).stride, block = kBlockEdge / stride;
  for (int begin = columns.begin; begin < columns.end;) {
    const float lambda = blend->lambda(level, begin * stride, j * stride);
    int end = begin;
    do {
      end = std::min((end / block + 1) * block, columns.end);
    } while (end < columns.end && blend->lambda(level, end * stride, j * stride) == lambda);
    body(NodeRange{begin, end}, lambda);
    begin = end;
  }
}

// What is interpolated is the new image less lambda of the old one, the latter being added whole afterwards:
// lambda of the detail that the old image had.
void ColourPyramid::interpolateRow(int level, NodeRange columns, int j, float lambda,
                                   std::vector<float>& line) {
  const NodeGrid &coarse = grid(level + 1), &fine = grid(level);
  // Nodes [first, last) of the coarser grid; those that the row reaches beyond its edges repeat its ends.
  const int first = std::max(columns.begin / 2 - 1, 0);
  const int last = std::min((columns.end + 1) / 2 + 2, coarse.columns);
  const size_t floats = size_t(last - first) * 4;
  constexpr int kMargin = 2;
  line.resize((size_t(coarse.columns) + 2 * kMargin) * 4);
  float* const nodes = line.data() + kMargin * 4;
  const bool odd = j & 1;
  if (odd) {
    const RowsAround r(coarse, first, j);
    interpolateRows(r.at[0], r.at[1], r.at[2], r.at[3], nodes + first * 4, floats);
  } else {
    std::copy_n(coarse.node(first, j / 2), floats, nodes + first * 4);
  }
  const float* old = fine.data;
  if (lambda != 0) {
    const NodeGrid oldCoarse = {old_[size_t(level) + 1].data(), coarse.columns, coarse.rows, coarse.stride};
    const RowsAround r(oldCoarse, first, j);
    if (odd)
      subtractRows(r.at[0], r.at[1], r.at[2], r.at[3], lambda, nodes + first * 4, floats);
    else
      subtractRow(oldCoarse.node(first, j / 2), lambda, nodes + first * 4, floats);
    if (level > 0) old = old_[size_t(level)].data();
  }
  if (first == 0) store4(nodes - 4, load4(nodes));
  for (int k = last; last == coarse.columns && k < last + kMargin; ++k)
    store4(nodes + 4 * k, load4(nodes + 4 * (last - 1)));
  const size_t row = size_t(j) * size_t(fine.columns) * 4;
  widenRow({nodes, odd ? nullptr : coarse.node(0, j / 2), old + row, lambda, level == 0}, columns.begin,
           columns.end, fine.data + row);
}

Float4 ColourPyramid::cubicAlongRow(const NodeGrid& grid, int i, int j, int reach) {
  return cubicBetween(load4(grid.nearest(i - 3 * reach, j)), load4(grid.nearest(i - reach, j)),
                      load4(grid.nearest(i + reach, j)), load4(grid.nearest(i + 3 * reach, j)));
}

Float4 ColourPyramid::cubicAlongColumn(const NodeGrid& grid, int i, int j, int reach) {
  return cubicBetween(load4(grid.nearest(i, j - 3 * reach)), load4(grid.nearest(i, j - reach)),
                      load4(grid.nearest(i, j + reach)), load4(grid.nearest(i, j + 3 * reach)));
}

Float4 ColourPyramid::cubicAfterColumn(const NodeGrid& grid, int i, int j) {
  return cubicBetween(load4(grid.nearest(i - 1, j)), load4(grid.nearest(i, j)), load4(grid.nearest(i + 1, j)),
                      load4(grid.nearest(i + 2, j)));
}

Float4 ColourPyramid::cubicAfterRow(const NodeGrid& grid, int i, int j) {
  return cubicBetween(load4(grid.nearest(i, j - 1)), load4(grid.nearest(i, j)), load4(grid.nearest(i, j + 1)),
                      load4(grid.nearest(i, j + 2)));
}

}  // namespace kairos
