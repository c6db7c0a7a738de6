// What is left out, and in which order the rest is done, never changes a bit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diff/differential_renderer.h"
#include "raycast/cast_frame.h"
#include "support/changes.h"
#include "support/images.h"

namespace kairos {
namespace {

TEST(Skipping, ChangesNoBitAndLeavesSomethingOut) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : {test::plume(type), test::sparseBalls(type), test::travellingFront(type, 48, 8)})
      for (const auto& tf : test::allTransferFunctions(type))
        for (const char* camera : {"iso", "inside", "close"})
          for (RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average}) {
            RenderSettings settings = test::settingsFor(scene, camera, tf.function);
            settings.mode = mode;
            settings.depth = settings.shade =
                mode == RenderMode::dvr && tf.function.opacityPoints().size() % 2 == 0;
            const test::Caster skipping(scene, settings);
            settings.skipInvisible = false;
            const test::Caster complete(scene, settings);
            for (const auto& kernel : skipping.kernels()) {
              const auto a = skipping.cast(kernel), b = complete.cast(kernel);
              ASSERT_EQ(a.pixels, b.pixels)
                  << scene.name << " " << tf.name << " " << camera << " " << kernel.name;
              EXPECT_EQ(b.counters.segmentsSkipped, 0u);
              EXPECT_GT(a.counters.segmentsSkipped, 0u) << scene.name << " " << tf.name << " " << camera;
              EXPECT_LT(a.counters.samples, b.counters.samples)
                  << scene.name << " " << tf.name << " " << camera;
            }
          }
}

TEST(Skipping, ChangesNoBitOfSlabs) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : {test::plume(type), test::sparseBalls(type), test::denseNoise(type)})
      for (const auto& tf : test::allTransferFunctions(type))
        for (const char* camera : {"iso", "close"})
          for (const double step : {0.4, 1.0, 5.0}) {
            RenderSettings settings = test::settingsFor(scene, camera, tf.function);
            settings.preintegrated = true;
            settings.step = step;
            const test::Caster skipping(scene, settings);
            settings.skipInvisible = false;
            const test::Caster complete(scene, settings);
            for (const auto& kernel : skipping.kernels())
              ASSERT_EQ(skipping.cast(kernel).pixels, complete.cast(kernel).pixels)
                  << scene.name << " " << tf.name << " " << camera << " " << kernel.name << " " << step;
          }
}

TEST(Skipping, IsConservativeForEveryValueInABricksRange) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : test::allScenes(type))
      for (const auto& tf : test::allTransferFunctions(type)) {
        const test::Caster caster(scene, test::settingsFor(scene, "iso", tf.function));
        uint32_t visible = 0;
        for (uint32_t cell = 0; cell < caster.volume().cellCount(); ++cell) {
          visible += caster.occupancy().visible(cell);
          if (caster.occupancy().visible(cell)) continue;
          const ValueRange range = caster.volume().range(cell);
          for (int i = 0; i <= 300; ++i) {
            const float value = std::lerp(range.lo, range.hi, float(i) / 300);
            ASSERT_EQ(caster.table().classify(value)[3], 0.0f)
                << scene.name << " " << tf.name << " value " << value;
          }
        }
        EXPECT_EQ(caster.occupancy().visibleCount(), visible);
      }
}

TEST(Skipping, LeavesOutWindowsOfVisibleBricksConservatively) {
  uint64_t leftOut = 0;
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : test::allScenes(type))
      for (const auto& tf : test::allTransferFunctions(type))
        for (RenderMode mode : {RenderMode::dvr, RenderMode::average, RenderMode::mip}) {
          RenderSettings settings = test::settingsFor(scene, "iso", tf.function);
          settings.mode = mode;
          const test::Caster caster(scene, settings);
          for (uint32_t cell = 0; cell < caster.volume().cellCount(); ++cell) {
            if (!caster.occupancy().visible(cell)) continue;
            const auto ranges = caster.volume().windowRanges(cell);
            for (size_t w = 0; w < kWindows; ++w) {
              if (caster.occupancy().windows()[cell] >> w & 1) continue;
              ++leftOut;
              for (int i = 0; i <= 20; ++i) {
                const float value = std::lerp(ranges[w].lo, ranges[w].hi, float(i) / 20);
                if (mode == RenderMode::dvr) {
                  ASSERT_EQ(caster.table().classify(value)[3], 0.0f) << scene.name << " " << tf.name;
                } else {
                  ASSERT_EQ(double(value), caster.volume().background()) << scene.name;
                }
              }
            }
          }
        }
  EXPECT_GT(leftOut, 1000u);
}

TEST(Skipping, FollowsUpdatesOfTheVolume) {
  ThreadPool pool(1);
  std::mt19937 random(12);
  const auto scene = test::plume(ElementType::u8);
  const RenderSettings settings =
      test::settingsFor(scene, "iso", test::windowedTransferFunction(ElementType::u8));
  const ClassificationTable table = settings.classification(scene.lattice);
  BrickVolume volume(scene.lattice, scene.field, pool);
  Occupancy followed(settings, table);
  followed.build(volume);
  std::vector<uint8_t> before;
  int flips = 0;
  for (int step = 0; step < 10; ++step) {
    const std::vector<uint8_t> old(followed.flags(), followed.flags() + volume.cellCount());
    const auto written =
        test::randomVoxels(ElementType::u8, scene.lattice.domain, step % 2 == 0 ? 5 : 3000, 0, random);
    const DirtyBricks& dirty = volume.apply(test::changesOf(ElementType::u8, written), pool);
    followed.update(volume, dirty, before);
    ASSERT_EQ(before.size(), dirty.cells.size());
    for (size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(before[i], old[dirty.cells[i]]);
      flips += before[i] != followed.flags()[dirty.cells[i]];
    }
    Occupancy fresh(settings, table);
    fresh.build(volume);
    EXPECT_EQ(followed.visibleCount(), fresh.visibleCount());
    for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
      ASSERT_EQ(followed.visible(cell), fresh.visible(cell));
      ASSERT_EQ(followed.windows()[cell], fresh.windows()[cell]);
    }
  }
  EXPECT_GT(flips, 0);
}

// ---- order ----

// Integrates all segments of all tiles one at a time in random order, keeps their partials, then composites
// each tile.
test::CastFrame castInRandomOrder(const test::Caster& caster, TileKernel kernel) {
  struct Job {
    int tile;
    uint32_t segment;
  };
  const int tiles = caster.view().tileCount();
  const size_t stride = size_t(caster.settings().channels()) * kLanes;
  std::vector<TileRays> rays;
  std::vector<std::vector<Segment>> segments(static_cast<size_t>(tiles));
  std::vector<std::vector<float>> partials(static_cast<size_t>(tiles));
  std::vector<Job> jobs;
  for (int tile = 0; tile < tiles; ++tile) {
    const auto t = size_t(tile);
    rays.push_back(caster.view().rays(tile));
    listSegments(caster.view(), rays.back(), caster.volume().gridSize(), segments[t]);
    partials[t].assign(segments[t].size() * stride, NAN);  // whatever is not integrated shows
    for (uint32_t s = 0; s < segments[t].size(); ++s) jobs.push_back({tile, s});
  }
  std::shuffle(jobs.begin(), jobs.end(), std::mt19937(7));
  test::CastFrame frame = caster.emptyFrame();
  std::vector<float> pixels(size_t(caster.settings().pixelPlanes()) * kLanes);
  for (const Job& job : jobs) {
    const auto t = size_t(job.tile);
    uint8_t stale = 1;
    kernel(
        caster.kernelScene(),
        {&rays[t], &segments[t][job.segment], 1, &partials[t][job.segment * stride], &stale, pixels.data()},
        frame.counters);
  }
  for (int tile = 0; tile < tiles; ++tile) {
    const auto t = size_t(tile);
    std::vector<uint8_t> fresh(segments[t].size(), 0);
    kernel(caster.kernelScene(),
           {&rays[t], segments[t].data(), uint32_t(segments[t].size()), partials[t].data(), fresh.data(),
            pixels.data()},
           frame.counters);
    caster.place(tile, pixels.data(), frame);
  }
  return frame;
}

TEST(Order, SegmentsIntegratedInRandomBrickOrderGiveTheSameBits) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : {test::plume(type), test::denseNoise(type)})
      for (const auto& tf : test::allTransferFunctions(type))
        for (const char* camera : {"iso", "inside", "close", "wide"})
          for (RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average}) {
            RenderSettings settings = test::settingsFor(scene, camera, tf.function);
            settings.mode = mode;
            settings.depth = settings.shade = mode == RenderMode::dvr && tf.name == std::string("soft");
            const test::Caster caster(scene, settings);
            for (const auto& kernel : caster.kernels()) {
              ASSERT_EQ(castInRandomOrder(caster, kernel.cast).pixels, caster.cast(kernel).pixels)
                  << scene.name << " " << tf.name << " " << camera << " " << kernel.name;
            }
          }
}

TEST(Order, StalePartialsBehindTheEndOfAllRaysAreLeftAlone) {
  const auto scene = test::constantScene(ElementType::u8, {60, 60, 60}, 1.0);
  const test::Caster caster(scene,
                            test::settingsFor(scene, "close", test::opaqueTransferFunction(ElementType::u8)));
  const TileKernel kernel = fastestKernel(caster.kernelScene(), Isa::automatic);
  const int tile = caster.view().tileCount() / 2;
  const TileRays rays = caster.view().rays(tile);
  std::vector<Segment> segments;
  listSegments(caster.view(), rays, caster.volume().gridSize(), segments);
  ASSERT_GT(segments.size(), 3u);
  std::vector<uint8_t> stale(segments.size(), 2);
  std::vector<float> partials(segments.size() * 4 * kLanes), pixels(5 * kLanes);
  TileCounters counters;
  kernel(caster.kernelScene(),
         {&rays, segments.data(), uint32_t(segments.size()), partials.data(), stale.data(), pixels.data()},
         counters);
  EXPECT_EQ(stale.front(), 0);
  EXPECT_EQ(stale.back(), 2);
  EXPECT_LT(counters.segmentsIntegrated, segments.size());
}

TEST(Order, SchedulingChangesNoBit) {
  using TileOrder = RendererOptions::TileOrder;
  for (const auto& scene : {test::jet1(60), test::plume(ElementType::f32)}) {
    RenderSettings settings =
        test::settingsFor(scene, "iso", test::windowedTransferFunction(scene.lattice.type), 62, 55);
    settings.shade = settings.depth = true;
    std::optional<Image> expected, expectedDepth;
    for (TileOrder order : {TileOrder::morton, TileOrder::rows, TileOrder::reversed})
      for (int tilesPerTask : {1, 7, 64})
        for (int threads : {1, 2, 4}) {
          RendererOptions options;
          options.tileOrder = order;
          options.tilesPerTask = tilesPerTask;
          options.threads = threads;
          DifferentialRenderer renderer(scene.lattice, settings, options);
          const Image& image = renderer.start(scene.field);
          if (!expected) {
            expected = image;
            expectedDepth = renderer.depth();
          }
          ASSERT_TRUE(test::imagesEqualBitForBit(image, *expected)) << tilesPerTask << " " << threads;
          ASSERT_TRUE(test::imagesEqualBitForBit(renderer.depth(), *expectedDepth))
              << tilesPerTask << " " << threads;
        }
  }
}

// ---- early ray termination ----

TEST(EarlyTermination, SavesSamplesForADifferenceBelowItsBound) {
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : {test::marschnerLobb(type, 60), test::denseNoise(type, 60)})
      for (float threshold : {0.999f, 0.9f, 0.5f}) {
        RenderSettings settings = test::settingsFor(scene, "close", test::opaqueTransferFunction(type));
        settings.terminate = 1;
        const auto complete = test::Caster(scene, settings).cast();
        settings.terminate = threshold;
        const test::Caster caster(scene, settings);
        for (const auto& kernel : caster.kernels()) {
          const auto frame = caster.cast(kernel);
          EXPECT_LT(frame.counters.samples, complete.counters.samples) << scene.name << " " << threshold;
          for (size_t i = 0; i < frame.pixels.size(); ++i)
            ASSERT_LE(std::abs(frame.pixels[i] - complete.pixels[i]), 1.5f * (1 - threshold) + 1e-5f)
                << scene.name << " " << threshold;
        }
      }
}

TEST(EarlyTermination, IsDecidedPerRay) {
  // A tile whose left rays end in an opaque wall and whose right rays pass beside it sees the far object in
  // full.
  test::Scene scene{"wall", test::denseLattice(ElementType::u8, {48, 48, 64}), {}};
  scene.field = test::sampledField(scene.lattice, [](const Vec3i& v) {
    const bool wall = v.z > 50 && v.x < 24, behind = v.z < 10;
    return wall ? 1.0 : behind ? 0.5 : 0.0;
  });
  RenderSettings settings =
      test::settingsFor(scene, "orthoZ", test::opaqueTransferFunction(ElementType::u8), 48, 48);
  const test::Caster caster(scene, settings);
  const auto reference = caster.reference();
  for (const auto& kernel : caster.kernels())
    EXPECT_LE(test::deviation(caster, caster.cast(kernel), reference).largest, 1e-5) << kernel.name;
}

}  // namespace
}  // namespace kairos
