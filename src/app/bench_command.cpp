// `kairos bench`: methods, budgets, sample distances and threads compared over a sequence.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/bench_arguments.h"
#include "app/bench_files.h"
#include "app/bench_page.h"
#include "app/bench_sweep.h"
#include "app/command.h"
#include "app/machine_info.h"
#include "app/progress_line.h"
#include "app/step_source.h"
#include "app/text_format.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "io/atomic_file.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos {
namespace {

std::string settingsText(const RenderSettings& s) {
  const bool perspective = s.camera.projection == Camera::Projection::perspective;
  static constexpr const char* kModes[] = {"emission and absorption", "maximum intensity", "average"};
  return std::string(perspective ? "perspective" : "orthographic") + ", " + kModes[int(s.mode)] +
         (s.shade ? ", shaded" : "") + (s.filter == Filter::nearest ? ", nearest voxel" : "") +
         formatted(", values from %g to %g", s.range.lo, s.range.hi);
}

BenchMachine thisMachine(const RenderSettings& settings) {
  BenchMachine machine;
  machine.processor = processorName();
  machine.system = systemName();
  machine.compiler = compilerName();
  machine.isa = name(settings.isa);
  machine.processors = int(std::thread::hardware_concurrency());
  machine.memoryBytes = systemMemory();
  return machine;
}

RenderSettings settingsOf(const BenchArguments& arguments, StepSource& source, const StopFlag& stop) {
  const auto settingsFor = [&](ValueRange range) {
    RenderSettings settings = arguments.view.settings(source.lattice(), range);
    settings.isa = bestIsa();
    return settings;
  };
  // Options are found wrong before a pass over the data begins.
  const RenderSettings settings = settingsFor({0, 1});
  if (!arguments.view.needsDataRange()) return settings;
  ProgressLine progress("scanning value range", "steps", arguments.quiet);
  return settingsFor(
      source.valueRange([&](int64_t done, int64_t total) { progress.update(done, total); }, stop));
}

BenchSequence sequenceOf(const StepSource& source, const SelectedSteps& selected) {
  BenchSequence sequence;
  sequence.name = source.name();
  sequence.elementType = name(source.lattice().type);
  sequence.dims = source.lattice().domain.size();
  sequence.steps.assign(source.steps().begin() + ptrdiff_t(selected.first),
                        source.steps().begin() + ptrdiff_t(selected.last) + 1);
  return sequence;
}

// The middle step where none was named. Throws OptionError for a step that is not rendered.
void choosePictures(const BenchArguments& arguments, const BenchSequence& sequence, SweepPlan& plan) {
  if (arguments.pictures && plan.pictureSteps.empty())
    plan.pictureSteps = {sequence.steps[sequence.steps.size() / 2]};
  for (const int64_t step : plan.pictureSteps)
    if (!std::binary_search(sequence.steps.begin(), sequence.steps.end(), step))
      refuseValue("--pictures", std::to_string(step),
                  "time steps that are rendered, from " + std::to_string(sequence.steps.front()) + " to " +
                      std::to_string(sequence.steps.back()));
}

// Methods that cannot render with these settings are left out, unless they were named.
void leaveOutUnfit(SweepPlan& plan, const Lattice& lattice, const RenderSettings& settings) {
  std::erase_if(plan.methods, [&](Method method) {
    RendererOptions options;
    options.method = method;
    options.threads = 1;
    try {
      makeRenderer(lattice, settings, options);
      return false;
    } catch (const OptionError&) {
      return true;
    }
  });
}

std::string summaryLine(const BenchCase& c, const CaseSummary& s) {
  std::string line = formatted("%-24s %9.2f ms  ", caseName(c).c_str(), s.timeMs.median);
  line += std::isfinite(s.psnr) ? formatted("%6.2f dB", s.psnr) : "   exact";
  if (s.conformity && s.conformity->frames)
    line += formatted("  off its budget by %.1f %% (95 %% of the steps)", 100 * s.conformity->deviation.p95);
  return line + "\n";
}

void printSummary(const BenchReport& report, const std::string& directory) {
  std::string text;
  for (size_t i = 0; i < report.cases.size(); ++i) {
    const BenchCase& c = report.cases[i];
    if (i == 0 || !sameGroup(c, report.cases[i - 1]))
      text += formatted("sample distance %g, ", c.sampleDistance) + countText(uint64_t(c.threads), "thread") +
              ": median time of a step, PSNR against the exact frame\n";
    text += "  " + summaryLine(c, summarise(report, i));
  }
  std::fputs((text + (std::filesystem::path(directory) / "index.html").string() + "\n").c_str(), stdout);
}

void writeReport(const BenchReport& report, const std::string& directory) {
  const std::filesystem::path base = directory;
  writeFileAtomically((base / "report.json").string(),
                      benchJson(report).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  writeFileAtomically((base / "frames.csv").string(), benchCsv(report));
  writeFileAtomically((base / "index.html").string(), benchPage(report));
}

void runBench(BenchArguments& arguments, CommandContext& context) {
  arguments.interpret();
  makeWritableDirectory(arguments.output);
  ThreadPool pool;  // for comparing steps of a simulation's files
  const auto source = openStepSource(arguments.input, 0, pool);
  const SelectedSteps selected = selectSteps(*source, arguments.frames, "--frames", arguments.framesText);
  if (selected.first == selected.last)
    throw OptionError("--frames", "a single step says nothing of changes; expected at least two");
  const RenderSettings settings = settingsOf(arguments, *source, context.stop);
  SweepPlan plan = arguments.plan;
  if (plan.sampleDistances.empty()) plan.sampleDistances = {settings.step};
  if (!arguments.methodsNamed) leaveOutUnfit(plan, source->lattice(), settings);

  BenchReport report;
  report.sequence = sequenceOf(*source, selected);
  choosePictures(arguments, report.sequence, plan);
  report.version = KAIROS_VERSION;
  report.created = currentTime();
  report.command = context.commandLine;
  report.width = settings.width;
  report.height = settings.height;
  report.picture = settingsText(settings);
  report.machine = thisMachine(settings);
  report.machine.loadBefore = loadAverage();

  context.whenInterrupted = "no report was written";
  ProgressLine progress("bench", "frames", arguments.quiet);
  Sweep sweep(*source, selected.first, selected.last, settings, std::move(plan), context.stop,
              [&](int64_t done, int64_t total) { progress.update(done, total); });
  sweep.run(report);
  progress.finish();
  report.machine.loadAfter = loadAverage();
  writeReport(report, arguments.output);
  if (!arguments.quiet) printSummary(report, arguments.output);
}

}  // namespace

void addBenchCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command = root.add_subcommand(
      "bench", "Compare methods, budgets, sample distances and threads over a sequence; write a report");
  auto arguments = std::make_shared<BenchArguments>();
  arguments->addTo(*command);
  command->callback([arguments, &context] {
    context.run = [arguments, &context] {
      runBench(*arguments, context);
      return 0;
    };
  });
}

}  // namespace kairos
