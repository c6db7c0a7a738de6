#include "core/image_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace kairos {
namespace {

Plane<double> testPlane(int width, int height) {
  Plane<double> p(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) p.row(y)[x] = std::sin(1.3 * x) + 0.1 * y * y + 0.01 * x * y;
  return p;
}

double directly(const Plane<double>& in, int x, int y, const Kernel<double>& kernel, bool alongRows) {
  const int radius = int(kernel.size() / 2);
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) {
    const int sx = std::clamp(alongRows ? x + k : x, 0, in.width - 1);
    const int sy = std::clamp(alongRows ? y : y + k, 0, in.height - 1);
    sum += kernel[size_t(k + radius)] * in.row(sy)[sx];
  }
  return sum;
}

TEST(ImageFilter, CorrelatesWithRepeatedBordersAlsoWhenTheKernelIsWiderThanTheImage) {
  const Kernel<double> lopsided{1, -2, 0.5, 3, 7};
  for (const auto& [width, height] : {std::pair{9, 6}, std::pair{2, 3}, std::pair{1, 1}}) {
    const Plane<double> in = testPlane(width, height);
    const Plane<double> rows = filterRows(in, lopsided), columns = filterColumns(in, lopsided);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        EXPECT_NEAR(rows.row(y)[x], directly(in, x, y, lopsided, true), 1e-12);
        EXPECT_NEAR(columns.row(y)[x], directly(in, x, y, lopsided, false), 1e-12);
      }
  }
}

TEST(ImageFilter, GaussianSumsToOneAndFallsAsItShould) {
  const Kernel<double> g = gaussianKernel<double>(1.5, 5);
  ASSERT_EQ(g.size(), 11u);
  EXPECT_NEAR(std::accumulate(g.begin(), g.end(), 0.0), 1, 1e-15);
  EXPECT_NEAR(g[5 + 3] / g[5], std::exp(-2.0), 1e-15);
  EXPECT_EQ(g[5 - 4], g[5 + 4]);
}

}  // namespace
}  // namespace kairos
