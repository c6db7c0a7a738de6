// What differential rendering leaves out, by its counters.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <tuple>

#include "sequences.h"

namespace kairos::test {
namespace {

/// Looks along -x at the middle of a volume, pixels finer than voxels, all rays through the same bricks'
/// middles.
RenderSettings alongX(const Lattice& lattice, const TransferFunction& tf) {
  const PointBox box = lattice.worldBounds();
  RenderSettings settings;
  settings.camera = fittedOrthographicCamera("x", box, 1);
  settings.camera.imageHeight = 20;
  settings.width = settings.height = 32;
  settings.transferFunction = tf;
  settings.range = {0, float(fullScale(lattice.type))};
  return settings;
}

class HiddenChanges : public testing::TestWithParam<int> {};

// A wall of one brick's thickness nearest to the eye; everything behind it changes at every step.
TEST_P(HiddenChanges, CostNoSamplesUntilTheyComeIntoView) {
  const int depth = GetParam();
  const Lattice lattice = denseLattice(ElementType::u8, {depth + 20, 32, 32});
  const VoxelBox behind{{0, 0, 0}, {depth - 6, 32, 32}}, wall{{depth, 0, 0}, {depth + 20, 32, 32}};
  VoxelMap first = filled(behind, 200);
  first.merge(filled(wall, 255));
  FramePair pair(lattice, alongX(lattice, opaqueTransferFunction(ElementType::u8)),
                 withMethod(Method::segments));
  ASSERT_TRUE(pair.start(fieldOf(lattice, first)));
  for (int step = 0; step < 6; ++step) {
    ASSERT_TRUE(pair.update(changesOf(ElementType::u8, filled(behind, step % 2 ? 200 : 120)))) << step;
    const FrameStatistics& s = pair.segments().statistics();
    EXPECT_GT(s.segmentsDirty, 0u);
    EXPECT_EQ(s.samples, 0u) << step;
    EXPECT_EQ(s.segmentsRecast, 0u) << step;
    EXPECT_EQ(s.pixelsChanged, 0u);
  }
  ASSERT_TRUE(pair.update(changesOf(ElementType::u8, filled(wall, 0))));
  EXPECT_GT(pair.segments().statistics().samples, 0u);
  EXPECT_EQ(pair.segments().statistics().pixelsChanged, 32u * 32u);
  ASSERT_TRUE(pair.update(changesOf(ElementType::u8, filled(wall, 255))));
}

INSTANTIATE_TEST_SUITE_P(BehindAWall, HiddenChanges, testing::Values(24, 60, 140));

TEST(InvisibleChanges, CostNoSamplesAndNoTiles) {
  const Lattice lattice = denseLattice(ElementType::u16, {48, 48, 48});
  // Values up to a fifth of the range are transparent; the lower half of the domain holds none but these.
  const VoxelBox low{{0, 0, 0}, {48, 48, 20}};
  VoxelMap first = filled({{0, 0, 28}, {48, 48, 48}}, 30000);
  FramePair pair(lattice, alongX(lattice, opaqueTransferFunction(ElementType::u16)),
                 withMethod(Method::segments));
  ASSERT_TRUE(pair.start(fieldOf(lattice, first)));
  std::mt19937 random(3);
  for (int step = 0; step < 5; ++step) {
    VoxelMap changes = randomVoxels(ElementType::u16, low, 5000, 0, random);
    for (auto& [v, value] : changes) value = std::fmod(value, 9000);
    ASSERT_TRUE(pair.update(changesOf(ElementType::u16, changes)));
    const FrameStatistics& s = pair.segments().statistics();
    EXPECT_GT(s.voxelsChanged, 1000u);
    EXPECT_EQ(s.segmentsDirty, 0u);
    EXPECT_EQ(s.tilesRecast, 0u);
    EXPECT_EQ(s.samples, 0u);
  }
  ASSERT_TRUE(pair.update(changesOf(ElementType::u16, {{{30, 24, 16}, 60000}})));
  EXPECT_GT(pair.segments().statistics().samples, 0u);
  EXPECT_GT(pair.segments().statistics().pixelsChanged, 0u);
}

TEST(ChangesOutOfSight, CostNothing) {
  const Scene noise = denseNoise(ElementType::u8, 64);
  const VoxelBox corner{{0, 0, 40}, {61, 12, 64}};
  std::mt19937 random(3);
  for (const bool clipped : {false, true}) {
    RenderSettings settings = alongX(noise.lattice, softTransferFunction(ElementType::u8));
    if (clipped) {
      settings.camera.imageHeight = 90;
      settings.clipBox = PointBox{{5, 20, 5}, {60, 55, 33}};
    } else {
      settings.camera.imageHeight = 8;
    }
    FramePair pair(noise.lattice, settings, withMethod(Method::segments));
    ASSERT_TRUE(pair.start(noise.field));
    ASSERT_TRUE(
        pair.update(changesOf(ElementType::u8, randomVoxels(ElementType::u8, corner, 3000, 0, random))));
    const FrameStatistics& s = pair.segments().statistics();
    EXPECT_GT(s.voxelsChanged, 1000u);
    EXPECT_EQ(s.segmentsDirty, 0u) << clipped;
    EXPECT_EQ(s.tilesRecast, 0u) << clipped;
    EXPECT_EQ(s.samples, 0u) << clipped;
  }
}

TEST(NoChange, CostsNothing) {
  const Scene noise = denseNoise(ElementType::f32, 32);
  FramePair pair(noise.lattice, settingsFor(noise, "iso", softTransferFunction(ElementType::f32)),
                 withMethod(Method::segments));
  ASSERT_TRUE(pair.start(noise.field));
  ASSERT_TRUE(pair.update(changesOf(ElementType::f32, {})));
  EXPECT_EQ(pair.segments().statistics().samples, 0u);
  EXPECT_EQ(pair.segments().statistics().tilesRecast, 0u);
  EXPECT_EQ(pair.segments().statistics().pixelsChanged, 0u);
}

// A lump of change jumps about in translucent noise that stands still.
TEST(LocalChange, IntegratesExactlyTheTouchedSegments) {
  const Scene noise = denseNoise(ElementType::u8, 80);
  for (const std::string camera : {"x", "iso", "ortho"}) {
    RenderSettings settings = settingsFor(noise, camera, softTransferFunction(ElementType::u8), 64, 64);
    settings.terminate = 1;
    FramePair pair(noise.lattice, settings, withMethod(Method::segments, 2));
    ASSERT_TRUE(pair.start(noise.field));
    std::mt19937 random(3);
    for (int step = 0; step < 6; ++step) {
      const Vec3i at{20 + 7 * step, 30 + 3 * step, 35};
      ASSERT_TRUE(pair.update(changesOf(
          ElementType::u8, randomVoxels(ElementType::u8, {at, at + Vec3i{6, 6, 6}}, 150, 0, random))));
      const FrameStatistics &s = pair.segments().statistics(), &f = pair.full().statistics();
      EXPECT_EQ(s.tilesUncached, 0u);
      EXPECT_GT(s.segmentsDirty, 0u);
      EXPECT_EQ(s.segmentsRecast, s.segmentsDirty) << camera << step;
      EXPECT_EQ(s.segmentsTotal, f.segmentsTotal);
      EXPECT_LT(s.segmentsRecast * 12, s.segmentsTotal) << camera << step;
      EXPECT_LT(s.samples * 12, f.samples) << camera << step;
      EXPECT_GT(s.samples, 0u);
      EXPECT_LT(s.tilesRecast * 4, f.tilesRecast);
    }
  }
}

TEST(LocalChange, BehindAFrontNothingIsIntegratedAgain) {
  const Sequence front = frontSequence(ElementType::u8);
  RenderSettings settings = settingsFor(front.scene(), "-y", softTransferFunction(ElementType::u8), 64, 64);
  settings.terminate = 1;
  FramePair pair(front.lattice, settings, withMethod(Method::segments));
  ASSERT_TRUE(pair.start(front.steps[0]));
  const std::vector<ChangedVoxels> changes = front.changes();
  uint64_t samples = 0, samplesOfFull = 0;
  for (size_t step = 0; step < changes.size(); ++step) {
    ASSERT_TRUE(pair.update(changes[step]));
    if (step < 4) continue;
    samples += pair.segments().statistics().samples;
    samplesOfFull += pair.full().statistics().samples;
  }
  EXPECT_GT(samples, 0u);
  EXPECT_LT(samples * 2, samplesOfFull);
}

// Tiles of 4x4 pixels in which an image shows anything.
size_t tilesNotBlank(const Image& image) {
  size_t tiles = 0;
  for (int y = 0; y < image.height; y += kTileEdge)
    for (int x = 0; x < image.width; x += kTileEdge) {
      bool blank = true;
      for (int j = y; j < std::min(y + kTileEdge, image.height); ++j)
        for (int i = x; i < std::min(x + kTileEdge, image.width); ++i) blank &= image.pixel(i, j)[3] == 0;
      tiles += !blank;
    }
  return tiles;
}

TEST(ChangeEverywhere, GoesPastTheCacheAndCostsAFullFrame) {
  const Sequence noise = noiseSequence(ElementType::u16);
  FramePair pair(noise.lattice, settingsFor(noise.scene(), "iso", softTransferFunction(ElementType::u16)),
                 withMethod(Method::segments));
  ASSERT_TRUE(pair.start(noise.steps[0]));
  EXPECT_EQ(pair.segments().statistics().tilesUncached, 0u);
  for (const ChangedVoxels& changes : noise.changes()) {
    ASSERT_TRUE(pair.update(changes));
    const FrameStatistics &s = pair.segments().statistics(), &f = pair.full().statistics();
    EXPECT_EQ(s.tilesUncached, tilesNotBlank(pair.segments().image()));
    EXPECT_GT(s.tilesUncached, 0u);
    EXPECT_EQ(s.samples, f.samples);
    EXPECT_EQ(s.segmentsRecast, f.segmentsRecast);
  }
}

TEST(Counters, NeverExceedAFullFrameNorDependOnThreads) {
  for (const Sequence& sequence : allSequences()) {
    RenderSettings settings =
        settingsFor(sequence.scene(), "iso", opaqueTransferFunction(sequence.lattice.type));
    settings.shade = true;
    DifferentialRenderer one(sequence.lattice, settings, withMethod(Method::segments, 1));
    DifferentialRenderer two(sequence.lattice, settings, withMethod(Method::segments, 2));
    DifferentialRenderer full(sequence.lattice, settings, withMethod(Method::full, 2));
    one.start(sequence.steps[0]);
    two.start(sequence.steps[0]);
    full.start(sequence.steps[0]);
    EXPECT_EQ(one.statistics().samples, full.statistics().samples);
    for (const ChangedVoxels& changes : sequence.changes()) {
      const Image before = one.image();
      one.update(changes);
      two.update(changes);
      full.update(changes);
      const FrameStatistics &a = one.statistics(), &b = two.statistics(), &f = full.statistics();
      EXPECT_LE(a.samples, f.samples) << sequence.name;
      EXPECT_LE(a.gradients, f.gradients) << sequence.name;
      EXPECT_LE(a.segmentsRecast, f.segmentsRecast) << sequence.name;
      EXPECT_LE(a.segmentsDirty, a.segmentsTotal);
      EXPECT_LE(a.tilesUncached, a.tilesRecast);
      EXPECT_EQ(a.voxelsChanged, changes.count());
      EXPECT_EQ(a.bricksVisible, f.bricksVisible);
      EXPECT_EQ(a.bricksVisible + a.bricksSkipped, one.volume().cellCount());
      EXPECT_EQ(std::tie(a.samples, a.gradients, a.segmentsDirty, a.segmentsRecast, a.pixelsChanged,
                         a.pixelsRecast, a.tilesRecast, a.tilesUncached),
                std::tie(b.samples, b.gradients, b.segmentsDirty, b.segmentsRecast, b.pixelsChanged,
                         b.pixelsRecast, b.tilesRecast, b.tilesUncached));
      uint64_t changed = 0;
      for (int y = 0; y < before.height; ++y)
        for (int x = 0; x < before.width; ++x)
          changed += std::memcmp(before.pixel(x, y), one.image().pixel(x, y), 16) != 0;
      EXPECT_EQ(a.pixelsChanged, changed) << sequence.name;
      EXPECT_EQ(f.pixelsChanged, changed) << sequence.name;
      EXPECT_EQ(f.pixelsRecast, uint64_t(before.width) * uint64_t(before.height));
    }
  }
}

// Bricks that vanish and come back: what they were marked with must not linger.
TEST(Counters, DirtySegmentsAreCountedAgainAfterABrickVanishedAndCameBack) {
  const Lattice lattice = denseLattice(ElementType::u8, {48, 48, 48});
  const VoxelBox lump{{18, 18, 18}, {26, 26, 26}};
  VoxelMap first = filled({{0, 0, 0}, {48, 48, 8}}, 80);
  FramePair pair(lattice, settingsFor({"", lattice, {}}, "iso", softTransferFunction(ElementType::u8)),
                 withMethod(Method::segments));
  ASSERT_TRUE(pair.start(fieldOf(lattice, first)));
  uint64_t dirty = 0;
  for (int step = 0; step < 6; ++step) {
    ASSERT_TRUE(pair.update(changesOf(ElementType::u8, filled(lump, step % 2 ? 0 : 200))));
    const uint64_t now = pair.segments().statistics().segmentsDirty;
    EXPECT_GT(now, 0u);
    if (step > 0) {
      EXPECT_EQ(now, dirty) << step;
    }
    dirty = now;
  }
}

}  // namespace
}  // namespace kairos::test
