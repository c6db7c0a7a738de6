#include "tcdvrm/colour_pyramid.h"

#include <algorithm>

#include "tcdvrm/interpolation_rows.h"

namespace kairos {
namespace {

// The nodes of a level on one line that stand still while the others are found: the even ones. `at(i)` yields
// even node i; neighbours beyond the edges are the outermost.
template <class At>
Float4 betweenEven(int i, int count, At&& at) {
  const int last = (count - 1) & ~1;
  if (i >= 3 && i + 3 <= last) return cubicBetween(at(i - 3), at(i - 1), at(i + 1), at(i + 3));
  return cubicBetween(at(std::max(i - 3, 0)), at(i - 1), at(std::min(i + 1, last)),
                      at(std::min(i + 3, last)));
}

// Interpolation overshoots at edges: no colour is below 0, no opacity above 1.
Float4 clamped(Float4 v) {
  const Float4 zero = {0, 0, 0, 0};
  v = v < zero ? zero : v;
  v[3] = std::min(v[3], 1.0f);
  return v;
}

// The four even rows around odd row j, from a column on; beyond the edges the outermost.
struct EvenRows {
  const float* at[4];
  EvenRows(const NodeGrid& grid, int column, int j) {
    const int last = (grid.rows - 1) & ~1;
    for (int r = 0; r < 4; ++r) at[r] = grid.node(column, std::clamp(j - 3 + 2 * r, 0, last));
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

ColourPyramid::ColourPyramid(Image& image, ThreadPool& pool) : pool_(pool) {
  grids_[0] = {image.data.data(), image.width, image.height, 1};
  for (size_t level = 1; level < grids_.size(); ++level) {
    NodeGrid& grid = grids_[level];
    grid.stride = 1 << level;
    grid.columns = (image.width - 1) / grid.stride + 1;
    grid.rows = (image.height - 1) / grid.stride + 1;
    storage_[level].assign(size_t(grid.columns) * size_t(grid.rows) * 4, 0.0f);
    grid.data = storage_[level].data();
  }
}

void ColourPyramid::takeImage(int level) {
  for (; level < kLevels; ++level) {
    const NodeGrid& g = grid(level);
    for (int j = 0; j < g.rows; ++j)
      for (int i = 0; i < g.columns; ++i)
        store4(g.node(i, j), load4(grid(0).node(i * g.stride, j * g.stride)));
  }
}

void ColourPyramid::takePixel(int x, int y) {
  const Float4 colour = load4(grids_[0].node(x, y));
  for (size_t level = 1; level < grids_.size() && ((x | y) & (grids_[level].stride - 1)) == 0; ++level)
    store4(grids_[level].node(x >> level, y >> level), colour);
}

// Calls body(run, row) for the grid's even or odd rows of all runs.
template <class Body>
void ColourPyramid::forRows(std::span<const BlockRun> runs, int level, int parity, Body&& body) {
  const NodeGrid& fine = grid(level);
  pool_.forEach(runs.size(), 8, [&](size_t begin, size_t end) {
    for (size_t r = begin; r < end; ++r) {
      const NodeRange rows = rowsOf(runs[r], fine);
      for (int j = rows.begin + ((rows.begin ^ parity) & 1); j < rows.end; j += 2) body(runs[r], j);
    }
  });
}

void ColourPyramid::keepDetail(int level, std::span<const BlockRun> runs) {
  const NodeGrid& g = grid(level);
  forRows(runs, level, 1, [&](const BlockRun& run, int j) {
    const NodeRange columns = columnsOf(run, g);
    const EvenRows rows(g, columns.begin, j);
    subtractInterpolation(rows.at[0], rows.at[1], rows.at[2], rows.at[3], g.node(columns.begin, j),
                          size_t(columns.end - columns.begin) * 4);
  });
  forRows(runs, level, 0, [&](const BlockRun& run, int j) {
    const NodeRange columns = columnsOf(run, g);
    for (int i = columns.begin | 1; i < columns.end; i += 2) {
      float* node = g.node(i, j);
      store4(node,
             load4(node) - betweenEven(i, g.columns, [&](int column) { return load4(g.node(column, j)); }));
    }
  });
}

void ColourPyramid::interpolate(int level, std::span<const BlockRun> runs, const DetailBlend* blend) {
  forRows(runs, level, 0, [&](const BlockRun& run, int j) {
    interpolateEvenRow(level, columnsOf(run, grid(level)), j, blend);
  });
  forRows(runs, level, 1, [&](const BlockRun& run, int j) {
    interpolateOddRow(level, columnsOf(run, grid(level)), j, blend);
  });
}

// Calls body(begin, end, lambda) for parts of the range that share a lambda.
template <class Body>
void ColourPyramid::forLambdas(int level, NodeRange columns, int j, const DetailBlend* blend, Body&& body) {
  if (!blend) return body(columns.begin, columns.end, 0.0f);
  const int stride = grid(level).stride, region = DetailBlend::kRegionEdge / stride;
  for (int begin = columns.begin; begin < columns.end;) {
    const int end = std::min((begin / region + 1) * region, columns.end);
    body(begin, end, blend->lambda(level, begin * stride, j * stride));
    begin = end;
  }
}

// A row of the coarser grid with its gaps filled.
void ColourPyramid::interpolateEvenRow(int level, NodeRange columns, int j, const DetailBlend* blend) {
  const NodeGrid &coarse = grid(level + 1), &fine = grid(level);
  const auto at = [&](int column) { return load4(coarse.node(column >> 1, j >> 1)); };
  forLambdas(level, columns, j, blend, [&](int begin, int end, float lambda) {
    for (int i = begin; i < end; ++i) {
      float* node = fine.node(i, j);
      Float4 value = i & 1 ? betweenEven(i, fine.columns, at) : at(i);
      if (blend && (i & 1)) value += lambda * load4(node);
      store4(node, level == 0 ? clamped(value) : value);
    }
  });
}

// A row between two that are complete.
void ColourPyramid::interpolateOddRow(int level, NodeRange columns, int j, const DetailBlend* blend) {
  const NodeGrid& fine = grid(level);
  forLambdas(level, columns, j, blend, [&](int begin, int end, float lambda) {
    const EvenRows rows(fine, begin, j);
    interpolateFloats(rows.at[0], rows.at[1], rows.at[2], rows.at[3], lambda, level == 0, fine.node(begin, j),
                      size_t(end - begin) * 4);
  });
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
