// The share of the previous image's detail in a refined one: worth much where steps are short, harmless where
// they are long.
#include <gtest/gtest.h>

#include <cmath>

#include "jet_sequence.h"

namespace kairos::test {
namespace {

std::vector<uint8_t> denseValues(const Scene& scene) {
  const Vec3i size = scene.lattice.domain.size();
  std::vector<uint8_t> values;
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) values.push_back(uint8_t(scene.field.value({x, y, z})));
  return values;
}

// `parts` steps for each one of the jet, linear in between.
JetSequence refinedJet(int first, int last, int parts) {
  Scene from = jet1(first);
  JetSequence sequence{from.lattice, from.field, {}};
  ChangeDetector detector(from.field, 0);
  ThreadPool pool(1);
  const Vec3i size = from.lattice.domain.size();
  std::vector<uint8_t> a = denseValues(from), mixed(a.size());
  for (int step = first + 1; step <= last; ++step) {
    const std::vector<uint8_t> b = denseValues(jet1(step));
    for (int part = 1; part <= parts; ++part) {
      const double share = double(part) / parts;
      for (size_t i = 0; i < a.size(); ++i) mixed[i] = uint8_t(std::lround(std::lerp(a[i], b[i], share)));
      sequence.changes.push_back(
          detector.advance(fieldFromDense(mixed.data(), size, uint8_t(from.lattice.background)), pool));
    }
    a = b;
  }
  return sequence;
}

double gainOfBlending(const JetSequence& sequence, double ofFull) {
  const RenderSettings settings = jetSettings(softTransferFunction(ElementType::u8));
  const ExactFrames exact = exactFrames(sequence, settings);
  RendererOptions options =
      withBudget(Method::anytime, Budget::ofSamples(uint64_t(ofFull * exact.meanSamples())));
  const double with = meanPsnr(sequence, settings, options, exact);
  options.blend = false;
  const double without = meanPsnr(sequence, settings, options, exact);
  std::printf("%2.0f %% of the samples: %.1f dB with the old detail, %.1f without\n", 100 * ofFull, with,
              without);
  return with - without;
}

TEST(RefinedSteps, OldDetailCostsLittleWhereItDoesNotPersist) {
  const JetSequence sequence = jetSequence(40, 52);
  for (const double ofFull : {0.05, 0.1, 0.25}) EXPECT_GT(gainOfBlending(sequence, ofFull), -1) << ofFull;
}

// At 5 % the usual lattice takes everything, so that there is no detail to keep.
TEST(RefinedSteps, OldDetailIsWorthMoreTheShorterStepsAre) {
  const double fourth = gainOfBlending(refinedJet(40, 46, 4), 0.1);
  const JetSequence sixteenth = refinedJet(40, 42, 16);
  EXPECT_GT(fourth, 1);
  EXPECT_GT(gainOfBlending(sixteenth, 0.1), fourth + 1);
  EXPECT_GT(gainOfBlending(sixteenth, 0.25), 2);
}

}  // namespace
}  // namespace kairos::test
