// The snippets of docs/api.md that need a budget (see tests/diff/api_test.cpp).
#include <gtest/gtest.h>

#include <cstdio>
#include <optional>

#include "diff/influence_map.h"
#include "jet_sequence.h"
#include "tcdvrm/tcdvrm_renderer.h"

namespace kairos::test {
namespace {

// A machine on which every frame fits its budget, so that the test does not depend on the one it runs on.
class FastClock : public BudgetClock {
 public:
  double now() override { return ms_; }
  void worked(uint64_t samples, uint64_t) override { ms_ += 1e-7 * double(samples); }

 private:
  double ms_ = 0;
};

TEST(Api, ABudgetForEveryFrame) {
  const Lattice lattice = jet1(30).lattice;
  const RenderSettings settings = jetSettings(softTransferFunction(ElementType::u8));
  const int steps = 3;
  std::vector<uint8_t> array;
  const auto simulate = [&](int step) {
    array.clear();
    const Field field = jet1(30 + step).field;
    const Vec3i dims = lattice.domain.size();
    for (int z = 0; z < dims.z; ++z)
      for (int y = 0; y < dims.y; ++y)
        for (int x = 0; x < dims.x; ++x)
          array.push_back(uint8_t(field.value(lattice.domain.lo + Vec3i{x, y, z})));
    return array.data();
  };
  std::vector<ErrorEstimate> reported;
  const auto show = [](const Image&) {};
  const auto report = [&](const ErrorEstimate& error) { reported.push_back(error); };

  FastClock clock;
  const auto makeRenderer = [&](const Lattice& l, const RenderSettings& s, RendererOptions withClock) {
    withClock.clock = &clock;
    return kairos::makeRenderer(l, s, withClock);
  };

  // clang-format off
RendererOptions options;
options.method = Method::anytime;
options.budget = Budget::framesPerSecond(50);  // or Budget::time(20), in ms, or Budget::ofSamples(2000000)
const std::unique_ptr<FrameRenderer> renderer = makeRenderer(lattice, settings, options);
for (int step = 0; step < steps; ++step) {
  show(renderer->render(simulate(step)));
  if (const std::optional<ErrorEstimate>& error = renderer->statistics().error) report(*error);
}
  // clang-format on

  ASSERT_EQ(reported.size(), size_t(steps));
  EXPECT_EQ(reported[0].high, 0);
}

TEST(Api, HowManyPixelsAChangeInfluences) {
  const JetSequence sequence = jetSequence(30, 31);
  const Lattice& lattice = sequence.lattice;
  const RenderSettings settings = jetSettings(softTransferFunction(ElementType::u8));
  const Field& first = sequence.start;
  const ChangedVoxels& changes = sequence.changes[0];
  // clang-format off
RendererOptions options;
options.method = Method::tcdvrm;
options.budget = Budget::time(5);  // milliseconds; or ofSamples(n), which repeats bit for bit
TcdvrmRenderer renderer(lattice, settings, options);
renderer.start(first);
renderer.update(changes);
const std::vector<uint64_t> pixelsByNumber = influenceHistogram(renderer.sampledInfluence());
  // clang-format on
  uint64_t pixels = 0;
  for (const uint64_t count : pixelsByNumber) pixels += count;
  EXPECT_LE(pixels, uint64_t(settings.width) * uint64_t(settings.height));
  EXPECT_GE(renderer.statistics().voxelsSampled, pixels > 0 ? 1u : 0u);
}

}  // namespace
}  // namespace kairos::test
