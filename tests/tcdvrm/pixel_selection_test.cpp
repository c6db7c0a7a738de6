// D(r, s) and TS against the algorithm's lines followed one by one.
#include "tcdvrm/pixel_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "diff/influence_map.h"
#include "example_one.h"

namespace kairos::test {
namespace {

uint32_t pointsOf(uint32_t unit) {
  return 3 + unit % 11;
}

/// Lines 8 to 14 of the algorithm, pixel by pixel.
struct Algorithm {
  std::vector<int32_t> d;
  std::vector<bool> unitCast;
  uint64_t ts = 0;

  void add(const PixelRows& j, int width, int edge) {
    const int unitsX = (width + edge - 1) / edge;
    for (int y = j.top; y <= j.bottom; ++y)
      for (int x = j.first[size_t(y)]; x <= j.last[size_t(y)]; ++x) {
        ++d[size_t(y * width + x)];
        const auto unit = uint32_t(y / edge * unitsX + x / edge);
        if (unitCast[unit]) continue;
        unitCast[unit] = true;
        ts += pointsOf(unit);
      }
  }
};

TEST(PixelSelection, CountsSamplesAndAddsEachRaysPointsOnce_D10) {
  std::mt19937 random(4);
  const Scene scene = plume(ElementType::u8, 32);
  const VoxelMap voxels = randomVoxels(ElementType::u8, scene.lattice.domain, 120, 0, random);
  for (const int edge : {1, 4})
    for (const ProjectionMode mode : {ProjectionMode::paper, ProjectionMode::conservative})
      for (const ProjectionOrder order : {ProjectionOrder::zero, ProjectionOrder::trilinear}) {
        const RenderSettings settings =
            settingsFor(scene, "close", softTransferFunction(ElementType::u8), 43, 39);
        const VoxelProjection projection(settings, scene.lattice, {order, mode});
        PixelSelection selection(projection, edge);
        for (int frame = 0; frame < 3; ++frame) {  // what was cleared leaves no trace
          selection.clear();
          Algorithm expected{std::vector<int32_t>(43 * 39), std::vector<bool>(43 * 39), 0};
          PixelRows j(settings.height);
          int taken = 0;
          for (const auto& [v, value] : voxels) {
            if (++taken % (frame + 1) != 0) continue;
            selection.add(v, pointsOf);
            projection.project(v, j);
            expected.add(j, settings.width, edge);
            ASSERT_EQ(selection.rayPoints(), expected.ts);
          }
          ASSERT_TRUE(std::ranges::equal(selection.counts(), expected.d));
          ASSERT_EQ(selection.units().size(),
                    size_t(std::count(expected.unitCast.begin(), expected.unitCast.end(), true)));
        }
      }
}

TEST(PixelSelection, EqualsTheInfluenceNumbersWhenAllVoxelsAreSampled_D17) {
  const ChangedVoxels changes = exampleChanges();
  ThreadPool pool(1);
  InfluenceMap influence(exampleProjection(), pool);
  influence.add(changes.leaves);
  influence.refresh();
  PixelSelection selection(exampleProjection(), 1);
  for (uint64_t i = 0; i < changes.count(); ++i) selection.add(changes.locate(i), pointsOf);
  EXPECT_TRUE(std::ranges::equal(selection.counts(), influence.numbers()));
  for (int r = 0; r < 4; ++r) EXPECT_EQ(selection.counts()[examplePixel(r)], kExampleInfluence[size_t(r)]);
  EXPECT_EQ(std::accumulate(selection.counts().begin(), selection.counts().end(), 0), 161);
}

TEST(PixelSelection, CastsThePixelsOfExample1InTheirOrderOfInfluence_D13) {
  PixelSelection selection(exampleProjection(), 1);
  const ChangedVoxels changes = exampleChanges();
  for (uint64_t i = changes.count(); i-- > 0;) selection.add(changes.locate(i), pointsOf);
  std::vector<uint32_t> expected;
  for (int r = 0; r < 4; ++r) expected.push_back(uint32_t(examplePixel(r)));
  EXPECT_EQ(selection.unitsByInfluence(), expected);
}

}  // namespace
}  // namespace kairos::test
