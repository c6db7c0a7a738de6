// The published differential methods against the full render.
#include "diff/dvrm_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "diff/second_order_difference.h"
#include "diff/sequences.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos::test {
namespace {

RendererOptions options(Method method, int threads = 1, ProjectionRules projection = {}) {
  RendererOptions o = withMethod(method, threads);
  o.projection = projection;
  return o;
}

/// Renders the sequence with two sets of options and compares every frame, depth included.
testing::AssertionResult sameFrames(const Sequence& sequence, const RenderSettings& settings,
                                    const RendererOptions& a, const RendererOptions& b) {
  const auto first = makeRenderer(sequence.lattice, settings, a);
  const auto second = makeRenderer(sequence.lattice, settings, b);
  const std::vector<ChangedVoxels> changes = sequence.changes();
  first->start(sequence.steps[0]);
  second->start(sequence.steps[0]);
  for (size_t step = 0; step <= changes.size(); ++step) {
    if (step > 0) {
      first->update(changes[step - 1]);
      second->update(changes[step - 1]);
    }
    auto same = imagesEqualBitForBit(first->image(), second->image());
    if (same && settings.depth) same = imagesEqualBitForBit(first->depth(), second->depth());
    if (!same) return same << " in step " << step << " of " << sequence.name;
  }
  return testing::AssertionSuccess();
}

RenderSettings settingsOf(const Sequence& sequence, const std::string& camera, bool shade = false) {
  RenderSettings settings =
      settingsFor(sequence.scene(), camera, softTransferFunction(sequence.lattice.type), 43, 38);
  settings.shade = shade;
  return settings;
}

class ConservativeMethods : public testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(All, ConservativeMethods, testing::Values(Method::dvrm, Method::tldvrm),
                         [](const auto& method) { return name(method.param); });

TEST_P(ConservativeMethods, EqualTheFullRenderInEveryView_D3) {
  for (const Sequence& sequence : {ballSequence(ElementType::f32), flickerSequence(ElementType::u8)})
    for (const std::string& camera : cameraNames())
      for (const bool shade : {false, true})
        EXPECT_TRUE(sameFrames(sequence, settingsOf(sequence, camera, shade), options(Method::full),
                               options(GetParam(), shade ? 2 : 1)))
            << camera << (shade ? " shaded" : "");
}

TEST_P(ConservativeMethods, EqualTheFullRenderForEverySequence_D3) {
  for (const Sequence& sequence : allSequences())
    for (const char* camera : {"iso", "close", "ortho"})
      EXPECT_TRUE(sameFrames(sequence, settingsOf(sequence, camera, true), options(Method::full),
                             options(GetParam(), 2)))
          << camera;
}

TEST_P(ConservativeMethods, EqualTheFullRenderForEveryFilterModeAndOrder_D4_D5) {
  const Sequence sequence = flickerSequence(ElementType::u8);
  for (const ProjectionOrder order : {ProjectionOrder::zero, ProjectionOrder::trilinear})
    for (const Filter filter : {Filter::trilinear, Filter::nearest})
      for (const RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average})
        for (const bool coarse : {false, true}) {
          RenderSettings settings = settingsOf(sequence, "iso");
          settings.filter = filter;
          settings.mode = mode;
          settings.depth = mode == RenderMode::dvr;
          if (coarse) settings.width = settings.height = 11;  // voxels finer than pixels
          EXPECT_TRUE(sameFrames(sequence, settings, options(Method::full),
                                 options(GetParam(), 2, {order, ProjectionMode::conservative})))
              << int(order) << int(filter) << int(mode) << coarse;
        }
}

TEST_P(ConservativeMethods, CastNoPacketThatNoChangeInfluences_D6) {
  const Sequence sequence = ballSequence(ElementType::u8);
  DvrmRenderer renderer(sequence.lattice, settingsOf(sequence, "iso"), options(GetParam()));
  renderer.start(sequence.steps[0]);
  for (const ChangedVoxels& changes : sequence.changes()) {
    renderer.update(changes);
    const FrameStatistics& s = renderer.statistics();
    const auto numbers = renderer.influence();
    uint64_t influenced = 0, packets = 0;
    for (int y = 0; y < 38; y += 4)
      for (int x = 0; x < 43; x += 4) {
        uint64_t here = 0;
        for (int i = 0; i < 16; ++i)
          if (x + i % 4 < 43 && y + i / 4 < 38)
            here += numbers[size_t(y + i / 4) * 43 + size_t(x + i % 4)] > 0;
        influenced += here;
        packets += here > 0;
      }
    EXPECT_EQ(s.pixelsInfluenced, influenced);
    EXPECT_EQ(s.tilesRecast, packets);
    EXPECT_LT(packets, uint64_t(11 * 10));
    EXPECT_GT(packets, 0u);
    EXPECT_GE(s.pixelsInfluenced, s.pixelsChanged);
    EXPECT_EQ(s.error->rmse, 0);
  }
}

TEST(Dvrm, ProjectsEveryChangedVoxel_D3) {
  const Sequence sequence = ballSequence(ElementType::u8);
  DvrmRenderer renderer(sequence.lattice, settingsOf(sequence, "iso"), options(Method::dvrm));
  renderer.start(sequence.steps[0]);
  for (const ChangedVoxels& changes : sequence.changes()) {
    renderer.update(changes);
    EXPECT_EQ(renderer.statistics().voxelsSampled, changes.count());
  }
}

TEST(Tldvrm, ProjectsOnlyTheSecondOrderDifference_D7) {
  for (const Sequence& sequence : {ballSequence(ElementType::u8), noiseSequence(ElementType::u16)}) {
    DvrmRenderer direct(sequence.lattice, settingsOf(sequence, "iso"), options(Method::dvrm));
    DvrmRenderer second(sequence.lattice, settingsOf(sequence, "iso"), options(Method::tldvrm));
    direct.start(sequence.steps[0]);
    second.start(sequence.steps[0]);
    std::vector<ChangedLeaf> before;
    for (const ChangedVoxels& changes : sequence.changes()) {
      direct.update(changes);
      second.update(changes);
      EXPECT_EQ(second.statistics().voxelsSampled, secondOrderDifference(before, changes.leaves).count());
      ASSERT_TRUE(std::ranges::equal(second.influence(), direct.influence()));
      before = changes.leaves;
    }
    second.start(sequence.steps[0]);  // starting again forgets the last step's changes
    second.update(sequence.changes()[0]);
    EXPECT_EQ(second.statistics().voxelsSampled, sequence.changes()[0].count());
  }
}

// The paper's J knows nothing of gradients and of a filter's reach: what it finds is right, what it misses
// stays.
TEST(PaperProjection, WritesOnlyTheChangedPixels_D4_D5) {
  const Sequence sequence = ballSequence(ElementType::u8);
  const RenderSettings settings = settingsOf(sequence, "close", true);
  for (const ProjectionOrder order : {ProjectionOrder::zero, ProjectionOrder::trilinear}) {
    DvrmRenderer renderer(sequence.lattice, settings,
                          options(Method::dvrm, 2, {order, ProjectionMode::paper}));
    const auto full = makeRenderer(sequence.lattice, settings, options(Method::full));
    renderer.start(sequence.steps[0]);
    full->start(sequence.steps[0]);
    uint64_t missed = 0;
    for (const ChangedVoxels& changes : sequence.changes()) {
      const Image before = renderer.image();
      renderer.update(changes);
      full->update(changes);
      const auto numbers = renderer.influence();
      for (int y = 0; y < settings.height; ++y)
        for (int x = 0; x < settings.width; ++x) {
          const bool changed = numbers[size_t(y * settings.width + x)] > 0;
          const float* expected = changed ? full->image().pixel(x, y) : before.pixel(x, y);
          ASSERT_TRUE(std::equal(expected, expected + 4, renderer.image().pixel(x, y))) << x << ' ' << y;
          missed += !std::equal(expected, expected + 4, full->image().pixel(x, y));
        }
      EXPECT_EQ(renderer.statistics().pixelsRecast, renderer.statistics().pixelsInfluenced);
      EXPECT_FALSE(renderer.statistics().error.has_value());
    }
    EXPECT_GT(missed, 0u) << "the scene shows nothing of what the conservative projection adds";
  }
}

TEST(Dvrm, PredictsEachStepFromTheStepsBefore_D8) {
  const Sequence sequence = ballSequence(ElementType::u8);
  DvrmRenderer renderer(sequence.lattice, settingsOf(sequence, "iso"), options(Method::dvrm));
  renderer.start(sequence.steps[0]);
  EXPECT_FALSE(renderer.statistics().predictedMs.has_value());
  for (const ChangedVoxels& changes : sequence.changes()) {
    const TimeModel before = renderer.timeModel();
    renderer.update(changes);
    const FrameStatistics& s = renderer.statistics();
    ASSERT_TRUE(s.predictedMs.has_value());
    const uint64_t voxels = uint64_t(sequence.lattice.domain.voxelCount());
    EXPECT_EQ(*s.predictedMs, before.predict({0, voxels, s.voxelsSampled, s.rayPoints}));
    EXPECT_GT(s.rayPoints, 0u);
  }
}

}  // namespace
}  // namespace kairos::test
