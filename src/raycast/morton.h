// An order in which neighbours on the image stay neighbours in time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace kairos {

/// Interleaves the bits of x and y.
inline uint64_t mortonCode(uint32_t x, uint32_t y) {
  const auto spread = [](uint64_t v) {
    v = (v | v << 16) & 0x0000ffff0000ffffull;
    v = (v | v << 8) & 0x00ff00ff00ff00ffull;
    v = (v | v << 4) & 0x0f0f0f0f0f0f0f0full;
    v = (v | v << 2) & 0x3333333333333333ull;
    return (v | v << 1) & 0x5555555555555555ull;
  };
  return spread(x) | spread(y) << 1;
}

/// The numbers 0 to columns * rows - 1 of a grid's elements, x fastest, along the Morton curve.
inline std::vector<uint32_t> mortonOrder(int columns, int rows) {
  std::vector<uint32_t> order(size_t(columns) * size_t(rows));
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto width = uint32_t(columns);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return mortonCode(a % width, a / width) < mortonCode(b % width, b / width);
  });
  return order;
}

}  // namespace kairos
