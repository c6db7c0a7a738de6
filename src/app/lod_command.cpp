// `kairos lod`: levels of detail through OpenGL, each frame within a time budget.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "app/command.h"
#include "app/frame_report.h"
#include "app/frame_writer.h"
#include "app/lod_arguments.h"
#include "app/progress_line.h"
#include "app/step_source.h"
#include "app/step_stream.h"
#include "app/text_format.h"
#include "core/error.h"
#include "io/file_bytes.h"
#include "io/hierarchy_file.h"
#include "lod/lod_renderer.h"

namespace kairos {
namespace {

using SystemClock = std::chrono::steady_clock;

double msSince(SystemClock::time_point begin) {
  return std::chrono::duration<double, std::milli>(SystemClock::now() - begin).count();
}

double milliseconds(double seconds) {
  return std::round(seconds * 1e7) / 1e4;
}

constexpr size_t kNumbersPerNode = 5;

StoredHierarchy stored(const LodHierarchy& hierarchy) {
  StoredHierarchy out{hierarchy.coarse, {}};
  out.statistics.reserve(hierarchy.nodes.size() * kNumbersPerNode);
  for (const NodeStatistics& n : hierarchy.nodes)
    out.statistics.insert(out.statistics.end(),
                          {double(n.count), n.mean, n.squares, n.squaresWithin[0], n.squaresWithin[1]});
  return out;
}

LodHierarchy restored(StoredHierarchy file) {
  LodHierarchy hierarchy{std::move(file.values), {}};
  for (size_t i = 0; i + kNumbersPerNode <= file.statistics.size(); i += kNumbersPerNode) {
    const double* n = file.statistics.data() + i;
    hierarchy.nodes.push_back({int64_t(n[0]), n[1], n[2], {n[3], n[4]}});
  }
  return hierarchy;
}

/// One run of the command.
class LodRun {
 public:
  LodRun(LodArguments& arguments, CommandContext& context) : arguments_(arguments), context_(context) {}
  void run();

 private:
  void open();
  void defineImages();
  void renderFrames();
  void start(const LoadedStep& step);
  void renderStep(const LoadedStep& step);
  void writeFrame(const LoadedStep& step, double updateMs);
  nlohmann::ordered_json record(const LoadedStep& step, double updateMs) const;
  void warnOnce(const LoadedStep& step);
  void summarise(SystemClock::time_point begin) const;

  std::string framePathOf(size_t index) const {
    return framePath(arguments_.output.pattern, source_->steps()[index]);
  }
  std::string hierarchyPath() const;
  uint64_t hierarchyIdentity() const;

  LodArguments& arguments_;
  CommandContext& context_;
  std::unique_ptr<ThreadPool> pool_;
  std::unique_ptr<StepSource> source_;
  size_t first_ = 0, last_ = 0;
  RenderSettings view_;
  LodSettings settings_;
  std::optional<GlContext> gl_;
  std::unique_ptr<LodRenderer> renderer_;
  std::unique_ptr<LodController> controller_;
  Importance importance_;
  SteadyClock clock_;
  std::optional<StatsFile> stats_;
  std::optional<ProgressLine> progress_;
  std::optional<FrameWriter> writer_;
  int64_t frames_ = 0, infeasible_ = 0;
  double renderSeconds_ = 0, longestSeconds_ = 0;
  bool warnedOfNonFinite_ = false, hierarchyReused_ = false;
};

void LodRun::run() {
  const auto begin = SystemClock::now();
  arguments_.interpret();
  arguments_.output.check();
  open();
  defineImages();
  gl_.emplace(arguments_.platform);
  renderFrames();
  summarise(begin);
}

void LodRun::open() {
  pool_ = std::make_unique<ThreadPool>(arguments_.threads);
  source_ = openStepSource(arguments_.input, 0, *pool_);
  const SelectedSteps selected =
      selectSteps(*source_, arguments_.output.frames, "--frames", arguments_.output.framesText);
  first_ = selected.first;
  last_ = selected.last;
}

void LodRun::defineImages() {
  // Options are found wrong before a pass over the data begins.
  view_ = arguments_.view.settings(source_->lattice(), {0, 1});
  settings_ = arguments_.settings(view_, source_->lattice());
  if (arguments_.view.needsDataRange()) {
    ProgressLine progress("scanning value range", "steps", arguments_.output.quiet);
    const ValueRange range = source_->valueRange(
        [&](int64_t done, int64_t total) { progress.update(done, total); }, context_.stop);
    view_ = arguments_.view.settings(source_->lattice(), range);
    settings_ = arguments_.settings(view_, source_->lattice());
  }
  importance_ = arguments_.importance(view_);
}

void LodRun::renderFrames() {
  stats_.emplace(arguments_.output.stats, false);
  progress_.emplace("rendering", "frames", arguments_.output.quiet);
  writer_.emplace(view_.camera, arguments_.output.exr, 1);
  StepStream stream(*source_, first_, last_);
  try {
    while (const auto step = stream.next()) {
      renderStep(*step);
      context_.stop.check();
    }
    writer_->finish();
  } catch (const Interrupted&) {
    writer_->finish();
    progress_->finish();
    context_.whenInterrupted =
        countText(uint64_t(frames_), "frame") + " of " + std::to_string(last_ - first_ + 1) + " written";
    throw;
  }
  progress_->finish();
}

// Beside the sequence; a simulation's files are left alone.
std::string LodRun::hierarchyPath() const {
  return arguments_.input.isSequence()
             ? framePath(source_->name() + "/lod.####.levels", source_->steps()[first_])
             : "";
}

uint64_t LodRun::hierarchyIdentity() const {
  const std::string text = std::to_string(source_->identity(first_, first_)) + " " +
                           std::to_string(settings_.subdivision.minimumResolution);
  return xxh64(text);
}

void LodRun::start(const LoadedStep& step) {
  const Field& field = std::get<Field>(step.content);
  const std::string path = hierarchyPath();
  std::optional<LodHierarchy> kept;
  if (!path.empty())
    if (auto file = readHierarchy(path, hierarchyIdentity())) kept = restored(std::move(*file));
  hierarchyReused_ = kept.has_value();
  renderer_ = std::make_unique<LodRenderer>(*gl_, source_->lattice(), field, settings_, *pool_,
                                            kept ? &*kept : nullptr);
  if (!path.empty() && !kept) {
    try {
      writeHierarchy(path, hierarchyIdentity(), stored(renderer_->volume().hierarchy()));
    } catch (const OutputError& error) {
      progress_->message(std::string("kairos: warning: the levels of detail are not kept: ") + error.what());
    }
  }
  LodProfile profile;
  if (arguments_.budgetSeconds > 0) profile = renderer_->profile(view_.camera, clock_);
  controller_ = arguments_.controller(view_, profile);
  // Every neighbour's level is known only after a frame.
  renderer_->render(view_.camera, *controller_, importance_, arguments_.budgetSeconds, clock_);
}

void LodRun::renderStep(const LoadedStep& step) {
  double updateMs = 0;
  if (std::holds_alternative<Field>(step.content)) {
    start(step);
  } else {
    const auto begin = SystemClock::now();
    try {
      renderer_->apply(std::get<ChangedVoxels>(step.content));
    } catch (const StateError& error) {
      throw StateError(source_->stepName(step.index) + ": " + error.what());
    }
    updateMs = msSince(begin);
  }
  renderer_->render(view_.camera, *controller_, importance_, arguments_.budgetSeconds, clock_);
  if (step.index == first_ && renderer_->statistics().subvolumes == 0 &&
      !renderer_->volume().subdivision().subvolumes().empty())
    progress_->message("kairos: warning: no part of the volume can be seen in the first frame");
  warnOnce(step);
  writeFrame(step, updateMs);
  const double seconds = renderer_->statistics().totalSeconds;
  renderSeconds_ += seconds;
  longestSeconds_ = std::max(longestSeconds_, seconds);
  progress_->update(++frames_, int64_t(last_ - first_ + 1));
}

void LodRun::warnOnce(const LoadedStep& step) {
  if (renderer_->statistics().infeasible && infeasible_++ == 0)
    progress_->message(formatted(
        "kairos: warning: %s (step %lld): even the coarsest levels take longer than the budget of %.4g ms",
        source_->stepName(step.index).c_str(), static_cast<long long>(source_->steps()[step.index]),
        arguments_.budgetSeconds * 1000));
  if (step.nonFinite == 0 || std::exchange(warnedOfNonFinite_, true)) return;
  progress_->message("kairos: warning: " + source_->stepName(step.index) + " holds " +
                     countText(uint64_t(step.nonFinite), "NaN or infinite voxel") + ", rendered as absent");
}

nlohmann::ordered_json LodRun::record(const LoadedStep& step, double updateMs) const {
  const LodStatistics& s = renderer_->statistics();
  std::vector<int> levels(size_t(renderer_->volume().pyramid().levels()), 0);
  for (const SubvolumeRecord& r : s.records) ++levels[size_t(r.level)];
  return {{"frame", source_->steps()[step.index]},
          {"method", std::string("lod-") + arguments_.methodName()},
          {"budget_ms", milliseconds(s.budgetSeconds)},
          {"total_ms", milliseconds(s.totalSeconds)},
          {"load_ms", milliseconds(step.loadMs / 1000)},
          {"update_ms", milliseconds(updateMs / 1000)},
          {"control_ms", milliseconds(s.controlSeconds)},
          {"texture_ms", milliseconds(s.loadSeconds)},
          {"geometry_ms", milliseconds(s.geometrySeconds)},
          {"rasterize_ms", milliseconds(s.rasterizeSeconds)},
          {"read_ms", milliseconds(s.readSeconds)},
          {"infeasible", s.infeasible},
          {"subvolumes", s.subvolumes},
          {"subvolumes_skipped", s.skipped},
          {"subvolumes_per_level", levels},
          {"slices", s.slices},
          {"fragments", std::round(s.fragments)},
          {"textures_loaded", s.texturesLoaded},
          {"textures_kept", s.texturesKept},
          {"texture_bytes_loaded", s.bytesLoaded},
          {"texture_bytes", renderer_->textureBytes()},
          {"open_boundaries", s.openBoundaries},
          {"levels_reused", hierarchyReused_},
          {"bytes_read", step.bytesRead},
          {"non_finite", step.nonFinite},
          {"renderer", gl_->renderer()}};
}

void LodRun::writeFrame(const LoadedStep& step, double updateMs) {
  FrameToWrite frame{framePathOf(step.index), {}, renderer_->image(), {}, {}, {}, {}};
  if (arguments_.output.png) frame.png = std::filesystem::path(frame.path).replace_extension(".png").string();
  frame.metadata = {{"comments", context_.commandLine},
                    {"kairos:version", std::string(KAIROS_VERSION)},
                    {"kairos:step", stepEntry(source_->steps()[step.index])},
                    {"kairos:method", std::string("lod-") + arguments_.methodName()},
                    {"kairos:renderer", gl_->renderer()},
                    {"kairos:budget", arguments_.budgetSeconds * 1000}};
  frame.written = [this, line = record(step, updateMs)](double writeMs) mutable {
    line["write_ms"] = milliseconds(writeMs / 1000);
    stats_->write(line.dump());
  };
  writer_->submit(std::move(frame));
}

void LodRun::summarise(SystemClock::time_point begin) const {
  if (arguments_.output.quiet) return;
  const LodStatistics& s = renderer_->statistics();
  std::printf("%s of %dx%d in %s (controller %s, %s)\n", countText(uint64_t(frames_), "frame").c_str(),
              view_.width, view_.height, durationText(msSince(begin) / 1000).c_str(), arguments_.methodName(),
              gl_->renderer().c_str());
  std::printf("a frame took %.1f ms to render; the longest %.1f ms", renderSeconds_ / double(frames_) * 1000,
              longestSeconds_ * 1000);
  if (arguments_.budgetSeconds > 0) std::printf(" (budget %.4g ms)", arguments_.budgetSeconds * 1000);
  std::printf("\n%s, %s skipped in the last frame: nothing of them can be seen\n",
              countText(s.subvolumes + s.skipped, "subvolume").c_str(), groupedText(s.skipped).c_str());
  if (infeasible_)
    std::printf("%s could not keep the budget even at the coarsest levels\n",
                countText(uint64_t(infeasible_), "frame").c_str());
  std::printf("%s ... %s\n", framePathOf(first_).c_str(), framePathOf(last_).c_str());
}

}  // namespace

void addLodCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command =
      root.add_subcommand("lod", "Render with levels of detail through OpenGL, within a time budget");
  auto arguments = std::make_shared<LodArguments>();
  arguments->addTo(*command);
  command->callback([arguments, &context] {
    context.run = [arguments, &context] {
      LodRun(*arguments, context).run();
      return 0;
    };
  });
}

}  // namespace kairos
