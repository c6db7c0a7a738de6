// Every sample of every ray belongs to exactly one segment, and is read from inside that segment's brick.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "raycast/cast_frame.h"

namespace kairos {
namespace {

struct SampleSpan {
  int32_t begin, end;
};

// A lane's share of a segment, by the definition in segment_index.h.
SampleSpan laneSpan(const test::Caster& caster, const TileRays& rays, const Segment& segment, int lane) {
  SampleSpan span{std::max(segment.kBegin, rays.kBegin[lane]), std::min(segment.kEnd, rays.kEnd[lane])};
  if (rays.packetOwned) return span;
  const Vec3i base = caster.volume().cellCoordinates(segment.cell) * kBrickEdge;
  for (int a = 0; a < 3; ++a) {
    const double origin = rays.origin[a][lane] + caster.view().footprintShift(), delta = rays.delta[a][lane];
    const int low = base[a], high = base[a] + kBrickEdge;
    span.begin = std::max(span.begin, firstSampleBeyond(delta < 0 ? high : low, origin, delta));
    span.end = std::min(span.end, firstSampleBeyond(delta < 0 ? low : high, origin, delta));
  }
  return span;
}

// The first voxel a sample reads along an axis, relative to the segment's brick; not rounded to whole voxels.
double lowCorner(const test::Caster& caster, const TileRays& rays, const Segment& segment, int lane,
                 int32_t k, int axis) {
  const double base = caster.volume().cellCoordinates(segment.cell)[axis] * kBrickEdge;
  return rays.origin[axis][lane] + (k + 0.5) * rays.delta[axis][lane] + caster.view().footprintShift() - base;
}

class SegmentLists {
 public:
  template <class F>
  static void forEachTile(const test::Caster& caster, F&& f) {
    std::vector<Segment> segments;
    for (int tile = 0; tile < caster.view().tileCount(); ++tile) {
      const TileRays rays = caster.view().rays(tile);
      segments.clear();
      listSegments(caster.view(), rays, caster.volume().gridSize(), segments);
      f(rays, segments);
    }
  }
};

struct Ownership {
  uint64_t samples = 0;
  int packetOwnedTiles = 0, laneOwnedTiles = 0;
};

// Each lane's spans, in the order of the list, must join up without gap or overlap from its first sample to
// its last. That is front to back and exactly once.
void checkTile(const test::Caster& caster, const TileRays& rays, const std::vector<Segment>& segments,
               Ownership& seen) {
  for (size_t s = 0; s < segments.size(); ++s) {
    ASSERT_LT(segments[s].kBegin, segments[s].kEnd);
    ASSERT_LT(segments[s].cell, caster.volume().cellCount());
    for (size_t other = 0; other < s; ++other)
      ASSERT_NE(segments[other].cell, segments[s].cell) << "a cell listed twice";
  }
  const double highest = rays.packetOwned ? kBrickStride - caster.view().footprintWidth() + 1 : kBrickEdge;
  for (int lane = 0; lane < kLanes; ++lane) {
    int32_t next = rays.kBegin[lane];
    for (const Segment& segment : segments) {
      const SampleSpan span = laneSpan(caster, rays, segment, lane);
      if (span.end <= span.begin) continue;
      ASSERT_EQ(span.begin, next) << "lane " << lane;
      next = span.end;
      for (int32_t k = span.begin; k < span.end; ++k)
        for (int a = 0; a < 3; ++a) {
          const double corner = lowCorner(caster, rays, segment, lane, k, a);
          ASSERT_GE(corner, -1e-6) << "lane " << lane << " sample " << k << " axis " << a;
          ASSERT_LE(corner, highest + 1e-6) << "lane " << lane << " sample " << k << " axis " << a;
        }
    }
    ASSERT_EQ(next, rays.kEnd[lane]) << "lane " << lane;
    seen.samples += uint64_t(rays.kEnd[lane] - rays.kBegin[lane]);
  }
  (rays.packetOwned ? seen.packetOwnedTiles : seen.laneOwnedTiles) += !segments.empty();
}

Ownership checkView(const test::Scene& scene, RenderSettings settings) {
  settings.skipInvisible = false;
  const test::Caster caster(scene, settings);
  Ownership seen;
  SegmentLists::forEachTile(caster, [&](const TileRays& rays, const std::vector<Segment>& segments) {
    if (!testing::Test::HasFatalFailure()) checkTile(caster, rays, segments, seen);
  });
  // And the kernels integrate exactly these.
  if (settings.terminate >= 1) {
    for (const auto& kernel : caster.kernels())
      EXPECT_EQ(caster.cast(kernel).counters.samples, seen.samples) << kernel.name;
  }
  return seen;
}

RenderSettings average(RenderSettings settings) {
  settings.mode = RenderMode::average;  // nothing stops a ray early
  settings.terminate = 1;
  return settings;
}

TEST(Ownership, OfEverySampleIsUniqueInEveryView) {
  Ownership all;
  for (const auto& scene : {test::plume(ElementType::u8), test::denseNoise(ElementType::u8)})
    for (const std::string& camera : test::cameraNames())
      for (double step : {0.3, 1.0, 2.5})
        for (Filter filter : {Filter::trilinear, Filter::nearest}) {
          RenderSettings settings =
              average(test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), 38, 41));
          settings.step = step;
          settings.filter = filter;
          const Ownership seen = checkView(scene, settings);
          if (HasFatalFailure()) FAIL() << scene.name << " " << camera << " step " << step;
          all.samples += seen.samples;
          all.packetOwnedTiles += seen.packetOwnedTiles;
          all.laneOwnedTiles += seen.laneOwnedTiles;
        }
  EXPECT_GT(all.packetOwnedTiles, 500);
  EXPECT_GT(all.laneOwnedTiles, 500);
}

TEST(Ownership, HoldsForShadedFootprints) {
  const auto scene = test::plume(ElementType::u8);
  for (const std::string& camera : test::cameraNames())
    for (Filter filter : {Filter::trilinear, Filter::nearest}) {
      RenderSettings settings =
          test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), 44, 40);
      settings.terminate = 1;
      settings.filter = filter;
      settings.shade = true;
      checkView(scene, settings);
      if (HasFatalFailure()) FAIL() << camera;
    }
}

// Parallel rays one voxel (or a half) apart that run exactly along brick faces and through voxel centres.
TEST(Ownership, HoldsForRaysOnBrickFaces) {
  const auto scene = test::plume(ElementType::u8);
  const Vec3i grid =
      test::Caster(scene, test::settingsFor(scene, "x", test::softTransferFunction(ElementType::u8)))
          .volume()
          .gridOrigin();
  for (const Vec3d& direction : {Vec3d{1, 0, 0},
                                 {-1, 0, 0},
                                 {0, 1, 0},
                                 {0, -1, 0},
                                 {0, 0, 1},
                                 {0, 0, -1},
                                 {1, 1, 0},
                                 {-1, 0, 1},
                                 {0, -1, -1}})
    for (double pitch : {1.0, 0.5, 4.0, 16.0})
      for (Filter filter : {Filter::trilinear, Filter::nearest})
        for (bool shade : {false, true})
          for (double step : {0.5, 1.0, 16.0}) {
            RenderSettings settings =
                test::settingsFor(scene, "x", test::softTransferFunction(ElementType::u8), 64, 64);
            settings.camera.projection = Camera::Projection::orthographic;
            settings.camera.imageHeight = 64 * pitch;
            const double half = 0.5 * pitch + (filter == Filter::nearest ? 0.5 : 0);
            settings.camera.eye = Vec3d(grid + Vec3i{32, 32, 32}) + Vec3d{half, half, half} - direction * 96;
            settings.camera.target = settings.camera.eye + direction;
            settings.camera.up = direction.z != 0 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
            settings.filter = filter;
            settings.step = step;
            settings.terminate = 1;
            settings.shade = shade;
            const Ownership seen = checkView(scene, settings);
            if (HasFatalFailure())
              FAIL() << direction.x << " " << direction.y << " " << direction.z << " pitch " << pitch;
            EXPECT_GT(seen.samples, 0u);
          }
}

TEST(Ownership, HoldsForAnEyeOnAVoxelAnEdgeOrACornerOfABrick) {
  const auto scene = test::plume(ElementType::u8);
  const Vec3i grid =
      test::Caster(scene, test::settingsFor(scene, "x", test::softTransferFunction(ElementType::u8)))
          .volume()
          .gridOrigin();
  for (const Vec3i& offset : {Vec3i{32, 32, 32}, {16, 32, 48}, {33, 32, 32}, {31, 37, 41}, {32, 40, 40}})
    for (const Vec3d& direction : {Vec3d{1, 0, 0}, {0, 0, -1}, {1, 1, 1}, {-1, 1, 0}, {0.3, -0.9, 0.2}})
      for (int edge : {32, 33}) {  // an odd image has a pixel exactly on the axis
        RenderSettings settings = average(
            test::settingsFor(scene, "inside", test::softTransferFunction(ElementType::u8), edge, edge));
        settings.camera.eye = Vec3d(grid + offset);
        settings.camera.target = settings.camera.eye + direction;
        settings.camera.up = std::abs(direction.z) > 0.9 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
        settings.camera.verticalFovDegrees = edge == 33 ? 90 : 40;
        EXPECT_GT(checkView(scene, settings).samples, 0u);
        if (HasFatalFailure()) FAIL() << offset.x << " " << direction.x;
      }
}

TEST(Ownership, HoldsForSlopesAlmostParallelToFaces) {
  const auto scene = test::denseNoise(ElementType::u8);
  for (double tilt : {1e-310, -1e-310, 1e-200, 1e-18, 1e-15, 1e-12, 1e-9, 1e-6, -1e-15, -1e-9, 1e-3}) {
    RenderSettings settings =
        average(test::settingsFor(scene, "x", test::softTransferFunction(ElementType::u8), 49, 49));
    settings.camera.projection = Camera::Projection::orthographic;
    settings.camera.imageHeight = 49;   // rays at whole voxels, brick faces among them
    settings.camera.eye = {0, 0, -30};  // so that the slopes below are not lost in the sum
    settings.camera.target = settings.camera.eye + Vec3d{tilt, -tilt, 1};
    settings.camera.up = {0, 1, 0};
    EXPECT_GT(checkView(scene, settings).samples, 0u);
    if (HasFatalFailure()) FAIL() << tilt;
  }
}

TEST(Ownership, HoldsForRandomViews) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto somewhere = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  const auto scene = test::plume(ElementType::u8, 40);
  const PointBox box = scene.lattice.worldBounds();
  const Vec3d centre = (box.lo + box.hi) * 0.5;
  for (int i = 0; i < 250; ++i) {
    RenderSettings settings =
        average(test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::u8), 21, 14));
    settings.camera.eye = centre + somewhere() * (i % 3 == 0 ? 20 : 120);
    settings.camera.target = centre + somewhere() * 15;
    settings.camera.up = somewhere();
    settings.camera.verticalFovDegrees = 80 + 79 * unit(random);
    settings.camera.projection =
        i % 4 == 0 ? Camera::Projection::orthographic : Camera::Projection::perspective;
    settings.camera.imageHeight = 30 + 29 * unit(random);
    settings.step = std::exp(1.5 * unit(random));
    settings.filter = i % 2 == 0 ? Filter::trilinear : Filter::nearest;
    checkView(scene, settings);
    if (HasFailure()) FAIL() << "view " << i;
  }
}

// ---- the sub-blocks a segment reads ----

struct SubBlockCount {
  uint64_t claimed = 0, read = 0, segments = 0;
};

// The sub-blocks of the voxels that the samples of a segment read, one by one.
uint64_t bruteForceSubBlocks(const test::Caster& caster, const TileRays& rays, const Segment& segment) {
  const int width = caster.view().footprintWidth();
  uint64_t mask = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const SampleSpan span = laneSpan(caster, rays, segment, lane);
    for (int32_t k = span.begin; k < span.end; ++k) {
      Vec3i low;
      for (int a = 0; a < 3; ++a)
        low[a] = std::clamp(int(std::floor(lowCorner(caster, rays, segment, lane, k, a))), 0,
                            kBrickStride - width);
      for (int z = low.z; z < low.z + width; ++z)
        for (int y = low.y; y < low.y + width; ++y)
          for (int x = low.x; x < low.x + width; ++x)
            mask |= uint64_t(1) << (x / kSubBlockEdge + 4 * (y / kSubBlockEdge) + 16 * (z / kSubBlockEdge));
    }
  }
  return mask;
}

SubBlockCount checkSubBlocks(const test::Scene& scene, const RenderSettings& settings) {
  const test::Caster caster(scene, settings);
  SubBlockCount count;
  SegmentLists::forEachTile(caster, [&](const TileRays& rays, const std::vector<Segment>& segments) {
    for (const Segment& segment : segments) {
      const uint64_t claimed = touchedSubBlocks(caster.view(), rays, caster.volume().gridSize(), segment);
      const uint64_t read = bruteForceSubBlocks(caster, rays, segment);
      EXPECT_EQ(read & ~claimed, 0u) << "cell " << segment.cell;
      count.claimed += uint64_t(std::popcount(claimed));
      count.read += uint64_t(std::popcount(read));
      ++count.segments;
    }
  });
  return count;
}

TEST(TouchedSubBlocks, MissNoVoxelThatASampleReads) {
  const auto scene = test::plume(ElementType::u8);
  for (const std::string& camera : test::cameraNames())
    for (double step : {0.4, 1.0, 3.0})
      for (bool shade : {false, true})
        for (Filter filter : {Filter::trilinear, Filter::nearest}) {
          RenderSettings settings =
              test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8));
          settings.step = step;
          settings.shade = shade;
          settings.filter = filter;
          const SubBlockCount count = checkSubBlocks(scene, settings);
          if (HasFailure()) FAIL() << camera << " step " << step;
          EXPECT_GT(count.segments, 0u) << camera;
        }
}

TEST(TouchedSubBlocks, AreFewWherePixelsAreFine) {
  const auto scene = test::plume(ElementType::u8);
  for (const char* camera : {"close", "orthoClose"}) {
    RenderSettings settings =
        test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8), 120, 120);
    const SubBlockCount count = checkSubBlocks(scene, settings);
    EXPECT_LT(count.claimed, 16 * count.segments) << camera;  // a quarter of a brick's 64
    EXPECT_LT(double(count.claimed), 1.5 * double(count.read)) << camera;
  }
}

TEST(SegmentIndex, LeadsFromBricksToTheirSegmentsAndBack) {
  const auto scene = test::plume(ElementType::u8);
  for (const char* camera : {"iso", "close", "wide"})
    for (int threads : {1, 4}) {
      const test::Caster caster(
          scene, test::settingsFor(scene, camera, test::softTransferFunction(ElementType::u8)));
      ThreadPool pool(threads);
      SegmentIndex index(caster.view(), caster.volume(), pool);
      EXPECT_FALSE(index.hasBrickIndex());
      index.buildBrickIndex(caster.view(), caster.volume(), pool);
      size_t listed = 0, fromBricks = 0;
      int tile = 0;
      SegmentLists::forEachTile(caster, [&](const TileRays& rays, const std::vector<Segment>& segments) {
        ASSERT_EQ(index.segments(tile).size(), segments.size());
        TileRays restored;
        index.rays(caster.view(), tile, restored);
        EXPECT_EQ(restored.packetOwned, rays.packetOwned);
        EXPECT_TRUE(std::equal(rays.kBegin, rays.kBegin + kLanes, restored.kBegin));
        EXPECT_TRUE(std::equal(rays.kEnd, rays.kEnd + kLanes, restored.kEnd));
        for (size_t s = 0; s < segments.size(); ++s) {
          const size_t number = index.begin(tile) + s;
          EXPECT_EQ(index.segment(number).cell, segments[s].cell);
          EXPECT_EQ(index.segment(number).kBegin, segments[s].kBegin);
          EXPECT_EQ(index.tileOf(number), uint32_t(tile));
          EXPECT_EQ(index.subBlocks(number),
                    touchedSubBlocks(caster.view(), rays, caster.volume().gridSize(), segments[s]));
          const auto mine = index.segmentsOf(segments[s].cell);
          EXPECT_NE(std::find(mine.begin(), mine.end(), number), mine.end());
        }
        listed += segments.size();
        ++tile;
      });
      for (uint32_t cell = 0; cell < caster.volume().cellCount(); ++cell)
        fromBricks += index.segmentsOf(cell).size();
      EXPECT_EQ(listed, index.segmentCount());
      EXPECT_EQ(fromBricks, index.segmentCount());
      EXPECT_GT(listed, 0u);
    }
}

}  // namespace
}  // namespace kairos
