#include "app/bench_sweep.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "app/bench_influence.h"
#include "app/error_map.h"
#include "app/text_format.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "io/png_file.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos {
namespace {

std::string pngText(const Image& image) {
  const std::vector<char> bytes = encodePng("a picture of the report", image);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Sweep::Sweep(StepSource& source, size_t first, size_t last, const RenderSettings& settings, SweepPlan plan,
             const StopFlag& stop, ProgressCallback progress)
    : source_(source),
      first_(first),
      last_(last),
      settings_(settings),
      plan_(std::move(plan)),
      stop_(stop),
      progress_(std::move(progress)) {}

void Sweep::listCases() {
  for (const double distance : plan_.sampleDistances)
    for (const int threads : plan_.threads) {
      report_->cases.push_back({Method::full, "", {}, distance, threads});
      for (const Method method : plan_.methods) {
        if (!budgeted(method)) {
          report_->cases.push_back({method, "", {}, distance, threads});
          continue;
        }
        for (const SweepBudget& budget : plan_.budgets)
          if (takes(method, budget.budget))
            report_->cases.push_back({method, budget.text, budget.budget, distance, threads});
      }
    }
}

void Sweep::run(BenchReport& report) {
  report_ = &report;
  report.repeats = plan_.repeats;
  report.processorTime = plan_.clock == &processorBudgetClock();
  listCases();
  for (const double distance : plan_.sampleDistances) {
    settings_.step = distance;
    exact_.emplace(settings_.width, settings_.height);
    for (int repeat = 0; repeat < plan_.repeats; ++repeat)
      for (size_t i = 0; i < report.cases.size(); ++i) {
        if (report.cases[i].sampleDistance != distance) continue;
        runCase(i, repeat);
        if (report.cases[i].method == Method::full && repeat == 0) resolveBudgets(i);
      }
  }
  noteChanges();
}

void Sweep::resolveBudgets(size_t fullCase) {
  const double fullMs = summarise(*report_, fullCase).timeMs.median;
  for (BenchCase& c : report_->cases) {
    if (c.budgetText.empty() || !sameGroup(c, report_->cases[fullCase])) continue;
    for (const SweepBudget& budget : plan_.budgets)
      if (budget.text == c.budgetText && budget.fraction > 0)
        c.budget = Budget::time(budget.fraction * fullMs);
  }
}

void Sweep::runCase(size_t benchCase, int repeat) {
  const BenchCase& c = report_->cases[benchCase];
  RendererOptions options;
  options.method = c.method;
  options.threads = c.threads;
  options.budget = c.budget;
  options.seed = plan_.seed + uint64_t(repeat);
  options.cacheMemory = plan_.cacheMemory;
  options.projection = plan_.projection;
  options.clock = plan_.clock;
  const auto renderer = makeRenderer(source_.lattice(), settings_, options);
  if (!renderer->seesVolume()) throw OptionError("--view", "no ray of this view meets the volume");
  for (size_t index = first_; index <= last_; ++index) {
    stop_.check();
    Stopwatch clock;
    const LoadedStep step = index == first_ ? source_.start(index) : source_.next();
    BenchFrame frame;
    frame.benchCase = benchCase;
    frame.repeat = repeat;
    frame.step = source_.steps()[index];
    frame.first = index == first_;
    frame.loadMs = clock.lap();
    renderStep(*renderer, step, frame);
    judge(*renderer, index - first_, frame);
    if (c.method == Method::tcdvrm && !frame.first && pictured(frame))
      takeHistogram(*renderer, std::get<ChangedVoxels>(step.content), frame);
    report_->frames.push_back(frame);
    progress_(++done_, int64_t((last_ - first_ + 1) * report_->cases.size()) * plan_.repeats);
  }
}

void Sweep::renderStep(FrameRenderer& renderer, const LoadedStep& step, BenchFrame& frame) {
  BudgetClock& clock = plan_.clock ? *plan_.clock : steadyBudgetClock();
  const double begin = clock.now();
  if (const auto* field = std::get_if<Field>(&step.content))
    renderer.start(*field);
  else
    renderer.update(std::get<ChangedVoxels>(step.content));
  frame.totalMs = clock.now() - begin;
  frame.statistics = renderer.statistics();
}

void Sweep::judge(const FrameRenderer& renderer, size_t index, BenchFrame& frame) {
  const Image& image = renderer.image();
  if (exact_->count() == index) exact_->append(image);
  const Image& exact = exact_->read(index);
  frame.error = colourError(image, exact);
  if (pictured(frame)) takePicture(image, exact, frame);
}

bool Sweep::pictured(const BenchFrame& frame) const {
  const auto& steps = plan_.pictureSteps;
  return frame.repeat == 0 && sameGroup(report_->cases[frame.benchCase], report_->cases.front()) &&
         std::find(steps.begin(), steps.end(), frame.step) != steps.end();
}

void Sweep::takePicture(const Image& image, const Image& exact, const BenchFrame& frame) {
  BenchPicture picture{frame.benchCase, frame.step, compareImages(image, exact), pngText(image), ""};
  if (picture.error.max > 0) picture.errorPng = pngText(errorMap(image, exact));
  report_->pictures.push_back(std::move(picture));
}

void Sweep::takeHistogram(const FrameRenderer& renderer, const ChangedVoxels& changes,
                          const BenchFrame& frame) {
  ThreadPool pool(report_->cases[frame.benchCase].threads);
  BenchHistogram histogram =
      influenceHistograms(VoxelProjection(settings_, source_.lattice(), plan_.projection), pool, changes,
                          renderer.aov(FrameRenderer::Aov::influence));
  histogram.benchCase = frame.benchCase;
  histogram.step = frame.step;
  histogram.voxelsChanged = frame.statistics.voxelsChanged;
  histogram.voxelsSampled = frame.statistics.voxelsSampled;
  report_->histograms.push_back(std::move(histogram));
}

void Sweep::noteChanges() {
  const Vec3i size = source_.lattice().domain.size();
  const double voxels = double(size.x) * size.y * size.z;
  std::vector<double> fractions;
  for (const BenchFrame& f : report_->frames)
    if (f.benchCase == 0 && f.repeat == 0 && !f.first)
      fractions.push_back(double(f.statistics.voxelsChanged) / voxels);
  const Spread spread = spreadOf(std::move(fractions));
  report_->sequence.changedFraction = spread.median;
  report_->sequence.largestChangedFraction = spread.most;
}

}  // namespace kairos
