#include "jet_sequence.h"

#include <cmath>

namespace kairos::test {

JetSequence jetSequence(int first, int last) {
  Scene scene = jet1(first);
  JetSequence sequence{scene.lattice, scene.field, {}};
  ChangeDetector detector(scene.field, 0);
  ThreadPool pool(1);
  for (int step = first + 1; step <= last; ++step)
    sequence.changes.push_back(detector.advance(jet1(step).field, pool));
  return sequence;
}

RenderSettings jetSettings(const TransferFunction& tf) {
  RenderSettings settings = settingsFor(jet1(40), "ortho", tf, 192, 192);
  settings.step = 0.5;
  return settings;
}

double ExactFrames::meanSamples() const {
  double sum = 0;
  for (const uint64_t s : samples) sum += double(s);
  return sum / double(samples.size());
}

ExactFrames exactFrames(const JetSequence& sequence, const RenderSettings& settings) {
  const auto renderer = makeRenderer(sequence.lattice, settings, withBudget(Method::full, {}));
  renderer->start(sequence.start);
  ExactFrames frames;
  for (const ChangedVoxels& changes : sequence.changes) {
    frames.images.push_back(renderer->update(changes));
    frames.samples.push_back(renderer->statistics().samples);
  }
  return frames;
}

RendererOptions withBudget(Method method, Budget budget, int threads) {
  RendererOptions options;
  options.method = method;
  options.budget = budget;
  options.threads = threads;
  return options;
}

double meanPsnr(const JetSequence& sequence, const RenderSettings& settings, const RendererOptions& options,
                const ExactFrames& exact) {
  const auto renderer = makeRenderer(sequence.lattice, settings, options);
  renderer->start(sequence.start);
  double squared = 0;
  for (size_t i = 0; i < sequence.changes.size(); ++i) {
    const double rmse = colourError(renderer->update(sequence.changes[i]), exact.images[i]).rmse;
    squared += rmse * rmse;
  }
  return -10 * std::log10(squared / double(sequence.changes.size()));
}

ChangedVoxels noChanges(ElementType type) {
  ChangedVoxels none;
  none.values = makeVoxelArray(type);
  return none;
}

}  // namespace kairos::test
