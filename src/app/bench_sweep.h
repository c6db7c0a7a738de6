// Runs the cases of `kairos bench` over a sequence and compares every frame with the exact one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/bench_records.h"
#include "app/frame_store.h"
#include "app/step_source.h"
#include "core/progress.h"
#include "raycast/render_settings.h"

namespace kairos {

/// A budget as typed: absolute, or a share of the median time of `full` at the same sample distance and
/// threads.
struct SweepBudget {
  std::string text;
  double fraction = 0;  // 0: `budget` holds
  Budget budget;
};

struct SweepPlan {
  std::vector<Method> methods;  // without `full`, which always runs first
  std::vector<SweepBudget> budgets;
  std::vector<double> sampleDistances;
  std::vector<int> threads;
  int repeats = 1;
  uint64_t seed = 0;  // of the first repeat; each further one has the next
  uint64_t cacheMemory = 0;
  BudgetClock* clock = nullptr;       // budgets and times of frames go by it; null: steadyBudgetClock()
  ProjectionRules projection;         // of dvrm, tldvrm and tcdvrm
  std::vector<int64_t> pictureSteps;  // of the first sample distance, threads and repeat
};

/// For each sample distance, repeat and number of threads: `full`, whose first frames are kept as the exact
/// ones, then every method that takes no budget, then every other one under every budget. A case renders the
/// whole sequence from its first step before the next case begins. Reading a step is not part of its time,
/// and nothing else goes on while a frame is rendered.
class Sweep {
 public:
  /// `source`'s steps `first` to `last` are rendered. The source and the stop flag must outlive the sweep.
  Sweep(StepSource& source, size_t first, size_t last, const RenderSettings& settings, SweepPlan plan,
        const StopFlag& stop, ProgressCallback progress);

  /// Fills in cases, frames, pictures and histograms, and how much of the volume changes. Throws Interrupted,
  /// and OptionError where the view does not meet the volume.
  void run(BenchReport& report);

 private:
  void listCases();
  void resolveBudgets(size_t fullCase);
  void runCase(size_t benchCase, int repeat);
  void renderStep(FrameRenderer& renderer, const LoadedStep& step, BenchFrame& frame);
  void judge(const FrameRenderer& renderer, size_t index, BenchFrame& frame);
  void takePicture(const Image& image, const Image& exact, const BenchFrame& frame);
  void takeHistogram(const FrameRenderer& renderer, const ChangedVoxels& changes, const BenchFrame& frame);
  void noteChanges();
  bool pictured(const BenchFrame& frame) const;

  StepSource& source_;
  size_t first_, last_;
  RenderSettings settings_;
  SweepPlan plan_;
  const StopFlag& stop_;
  ProgressCallback progress_;
  BenchReport* report_ = nullptr;
  std::optional<FrameStore> exact_;  // of the sample distance at hand
  int64_t done_ = 0;
};

}  // namespace kairos
