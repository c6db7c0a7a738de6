// Interpolating between cast nodes: pyramid, blend, queue.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tcdvrm/block_queue.h"
#include "tcdvrm/colour_pyramid.h"
#include "tcdvrm/detail_blend.h"
#include "tcdvrm/interpolation_rows.h"

namespace kairos::test {
namespace {

float polynomial(int x, int y, int c) {
  const double u = x / 64.0, v = y / 64.0;
  return float(0.2 + 0.1 * c + 0.3 * u * u * u - 0.2 * u * v * v + 0.1 * v * v * v);
}

TEST(ColourPyramid, InterpolatesCubicsExactlyAwayFromTheEdges) {
  constexpr int kEdge = 70;
  Image image(kEdge, kEdge, 4);
  ThreadPool pool(2);
  for (int y = 0; y < kEdge; ++y)
    for (int x = 0; x < kEdge; ++x)
      for (int c = 0; c < 4; ++c) image.pixel(x, y)[c] = c == 3 ? 0.5f : polynomial(x, y, c);
  const Image wanted = image;
  ColourPyramid pyramid(image, pool);
  pyramid.takeImage();
  BlockSet blocks(kEdge, kEdge);
  for (size_t b = 0; b < blocks.size(); ++b) blocks.set(b, true);
  const auto runs = blocks.runs();
  // Only the nodes of stride 4 remain known.
  for (int level : {0, 1}) {
    const NodeGrid& grid = pyramid.grid(level);
    for (int j = 0; j < grid.rows; ++j)
      for (int i = 0; i < grid.columns; ++i)
        if ((i | j) & 1) store4(grid.node(i, j), Float4{9, 9, 9, 9});
  }
  pyramid.interpolate(1, runs, nullptr);
  pyramid.interpolate(0, runs, nullptr);
  for (int y = 12; y < kEdge - 16; ++y)
    for (int x = 12; x < kEdge - 16; ++x)
      for (int c = 0; c < 4; ++c)
        ASSERT_NEAR(image.pixel(x, y)[c], wanted.pixel(x, y)[c], 1e-5) << x << " " << y;
}

TEST(ColourPyramid, LeavesBlocksThatAreNotLiveAlone) {
  Image image(64, 48, 4);
  std::mt19937 random(1);
  for (float& v : image.data) v = float(random() % 1000) / 1000;
  const Image before = image;
  ThreadPool pool(1);
  ColourPyramid pyramid(image, pool);
  pyramid.takeImage();
  BlockSet blocks(64, 48);
  blocks.set(blocks.index(3, 2), true);
  pyramid.interpolate(0, blocks.runs(), nullptr);
  int changed = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool same = std::equal(image.pixel(x, y), image.pixel(x, y) + 4, before.pixel(x, y));
      changed += !same;
      EXPECT_TRUE(same || blocks.blockAt(x, y) == blocks.index(3, 2)) << x << " " << y;
    }
  EXPECT_EQ(changed, 48) << "all but the nodes of stride 2";
}

TEST(ColourPyramid, AllOfTheOldDetailGivesTheOldImageBack) {
  Image image(64, 64, 4);
  std::mt19937 random(2);
  for (float& v : image.data) v = float(random() % 1000) / 1000;
  const Image before = image;
  ThreadPool pool(1);
  ColourPyramid pyramid(image, pool);
  pyramid.takeImage();
  DetailBlend blend(64, 64);
  const Float4 one = {1, 1, 1, 1};
  for (int level = 0; level < DetailBlend::kLevels; ++level)
    for (int i = 0; i < 8; ++i) blend.observe(level, 8 * i, 8 * i, one, one);
  blend.beginFrame();
  EXPECT_TRUE(blend.worthwhile());
  BlockSet blocks(64, 64);
  for (size_t b = 0; b < blocks.size(); ++b) blocks.set(b, true);
  pyramid.keepOld(blocks.runs());
  for (const int level : {1, 0}) pyramid.interpolate(level, blocks.runs(), &blend);
  for (size_t i = 0; i < image.data.size(); ++i) ASSERT_NEAR(image.data[i], before.data[i], 1e-5);
}

TEST(DetailBlend, FindsTheShareOfTheOldDetailThatIsStillThere) {
  DetailBlend blend(64, 64);
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 500; ++i) {
    const float old = normal(random), noise = 0.1f * normal(random);
    blend.observe(1, 10, 10, Float4{} + (0.6f * old + noise), Float4{} + old);
  }
  blend.beginFrame();
  EXPECT_NEAR(blend.lambda(1, 10, 10), 0.6, 0.03);
  EXPECT_TRUE(blend.worthwhile());
}

TEST(DetailBlend, DetailThatHasGoneIsNotWorthBlending) {
  DetailBlend blend(64, 64);
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 500; ++i) blend.observe(0, 5, 5, Float4{} + normal(random), Float4{} + normal(random));
  blend.beginFrame();
  EXPECT_FALSE(blend.worthwhile());
  EXPECT_LT(blend.lambda(0, 5, 5), 0.2);
}

TEST(InterpolationRows, ColoursStayAboveZeroAndOpacitiesBelowOne) {
  std::vector<float> row(20, 0.0f), out(16, 7.0f);
  std::fill_n(row.begin() + 4, 8, 2.0f);  // nodes 0 and 1 of -1 to 3
  const WidenedRow nodes{row.data() + 4, nullptr, nullptr, 0, true};
  widenRow(nodes, 0, 4, out.data());
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 4; ++c) {
      const float wanted = i == 3 ? 0.5625f * 2 - 0.0625f * 2 : i == 1 ? 0.5625f * 4 : 2;
      EXPECT_EQ(out[size_t(4 * i + c)], c == 3 ? 1 : wanted) << i;
    }
  std::fill_n(row.begin() + 4, 8, -2.0f);
  widenRow(nodes, 0, 4, out.data());
  for (const float v : out) EXPECT_EQ(v, 0);
}

TEST(BlockQueue, TheBestComesFirstWithinAFactorOfTheSquareRootOfTwo) {
  BlockQueue<float> queue;
  std::mt19937 random(6);
  for (int i = 0; i < 1000; ++i) {
    const float priority = std::exp2(float(random() % 600) / 10 - 40);
    queue.push(priority, priority);
  }
  queue.push(0, 0);
  EXPECT_EQ(queue.size(), 1001u);
  float before = std::numeric_limits<float>::infinity();
  while (!queue.empty()) {
    const float priority = queue.pop();
    EXPECT_LE(priority, before * 1.5f);
    before = std::min(before, priority);
  }
  EXPECT_EQ(before, 0);
}

}  // namespace
}  // namespace kairos::test
