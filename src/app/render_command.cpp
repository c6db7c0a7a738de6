// `kairos render`: the dynamic phase, from a sequence or a simulation's files to images.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "app/command.h"
#include "app/frame_report.h"
#include "app/frame_writer.h"
#include "app/progress_line.h"
#include "app/render_arguments.h"
#include "app/resume.h"
#include "app/step_source.h"
#include "app/step_stream.h"
#include "app/text_format.h"
#include "core/error.h"
#include "core/image_difference.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos {
namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// One run of the command.
class RenderRun {
 public:
  RenderRun(RenderArguments& arguments, CommandContext& context) : arguments_(arguments), context_(context) {}

  void run();

 private:
  void open();
  void selectFrames();
  ValueRange dataRange();
  void defineImages();
  void findStandingFrames();
  void renderFrames();
  void renderStep(const LoadedStep& step, Clock::time_point begin);
  void writeFrame(const LoadedStep& step, const FrameTimes& times);
  void show(const LoadedStep& step, FrameRenderer& renderer);
  std::vector<std::pair<std::string, Image>> aovs() const;
  void warnOfNonFinite(const LoadedStep& step);
  void summarise(Clock::time_point begin);

  std::string framePathOf(size_t index) const {
    return framePath(arguments_.output.pattern, source_->steps()[index]);
  }
  std::string pngPathOf(size_t index) const {
    return arguments_.output.png
               ? std::filesystem::path(framePathOf(index)).replace_extension(".png").string()
               : "";
  }
  std::string fingerprintOf(size_t index) const {
    return frameFingerprint(settingsHash_, source_->identity(firstSelected_, index));
  }
  bool stands(size_t index) const { return stands_[index - firstSelected_]; }
  int64_t framesToWrite() const { return std::count(stands_.begin(), stands_.end(), false); }

  RenderArguments& arguments_;
  CommandContext& context_;
  std::unique_ptr<ThreadPool> pool_;  // for comparing steps, if they have to be
  std::unique_ptr<StepSource> source_;
  size_t firstSelected_ = 0, lastSelected_ = 0;
  RenderSettings settings_;
  RunDescription description_;
  uint64_t settingsHash_ = 0;
  std::vector<bool> stands_;  // per selected step: finished by an earlier run
  std::unique_ptr<FrameRenderer> renderer_;
  std::unique_ptr<FrameRenderer> verifier_;  // the exact frames, with --verify
  std::optional<StatsFile> stats_;
  std::optional<ProgressLine> progress_;
  std::optional<FrameWriter> writer_;  // its callbacks use the ones above
  RunSummary summary_;
  int64_t submitted_ = 0;
  bool warnedOfNonFinite_ = false;
};

void RenderRun::run() {
  const auto begin = Clock::now();
  arguments_.interpret();
  arguments_.output.check();
  open();
  selectFrames();
  defineImages();
  findStandingFrames();
  if (framesToWrite() > 0) renderFrames();
  summarise(begin);
}

void RenderRun::open() {
  pool_ = std::make_unique<ThreadPool>(arguments_.renderer.threads);
  source_ = openStepSource(arguments_.input, arguments_.tolerance, *pool_);
}

void RenderRun::selectFrames() {
  const SelectedSteps selected =
      selectSteps(*source_, arguments_.output.frames, "--frames", arguments_.output.framesText);
  firstSelected_ = selected.first;
  lastSelected_ = selected.last;
}

ValueRange RenderRun::dataRange() {
  ProgressLine progress("scanning value range", "steps", arguments_.output.quiet);
  return source_->valueRange([&](int64_t done, int64_t total) { progress.update(done, total); },
                             context_.stop);
}

void RenderRun::defineImages() {
  const auto settingsFor = [&](ValueRange range) {
    RenderSettings settings = arguments_.view.settings(source_->lattice(), range);
    settings.isa = arguments_.isa == Isa::automatic ? bestIsa() : arguments_.isa;
    settings.depth = arguments_.depth;
    settings.validate();
    return settings;
  };
  // Options are found wrong before a pass over the data begins.
  settings_ = settingsFor({0, 1});
  if (arguments_.view.needsDataRange()) settings_ = settingsFor(dataRange());
  description_ = {name(arguments_.renderer.method),
                  name(settings_.isa),
                  arguments_.renderer.threads,
                  settings_.width,
                  settings_.height,
                  arguments_.renderer.budget,
                  !budgeted(arguments_.renderer.method) && publishedMethodText(arguments_.renderer).empty()};
  const std::string storage = formatted("half %d compression %d", int(arguments_.output.exr.half),
                                        int(arguments_.output.exr.compression));
  std::string further = storage;
  for (const FrameRenderer::Aov aov : arguments_.aovs)
    further += std::string(" aov ") + FrameRenderer::name(aov);
  if (budgeted(arguments_.renderer.method))
    further += formatted(" %s %s seed %llu", description_.method.c_str(), arguments_.budgetText.c_str(),
                         (unsigned long long)arguments_.renderer.seed);
  further += publishedMethodText(arguments_.renderer);
  settingsHash_ = settingsFingerprint(settings_, source_->lattice(), further);
}

void RenderRun::findStandingFrames() {
  stands_.assign(lastSelected_ - firstSelected_ + 1, false);
  if (!arguments_.resume) return;
  for (size_t index = firstSelected_; index <= lastSelected_; ++index) {
    context_.stop.check();
    stands_[index - firstSelected_] =
        frameStands(framePathOf(index), pngPathOf(index), settings_, fingerprintOf(index));
  }
}

void RenderRun::renderFrames() {
  // Frames that stand are passed over; those before the first missing one are not even rendered where the
  // step can be had without them.
  size_t first = firstSelected_, last = lastSelected_;
  while (stands(last)) --last;
  if (source_->seekable())
    while (stands(first)) ++first;
  // The first step is read while the renderer prepares the view.
  StepStream stream(*source_, first, last);

  renderer_ = makeRenderer(source_->lattice(), settings_, arguments_.renderer);
  if (arguments_.verify) {
    RendererOptions exact = arguments_.renderer;
    exact.method = Method::segments;
    verifier_ = makeRenderer(source_->lattice(), settings_, exact);
  }
  if (!renderer_->seesVolume())
    throw OptionError(
        settings_.clipBox ? "--clip-box" : "--eye",
        "no ray of this view meets the volume" +
            std::string(settings_.clipBox ? " inside the clip box" : "") +
            "; check --eye, --target, --fov, --ortho and --clip-box against the volume's bounds " +
            "(kairos info shows them), or use --view");
  stats_.emplace(arguments_.output.stats, arguments_.resume);
  progress_.emplace("rendering", "frames", arguments_.output.quiet);
  writer_.emplace(settings_.camera, arguments_.output.exr, std::clamp(arguments_.renderer.threads, 1, 4));
  try {
    for (auto begin = Clock::now(); auto step = stream.next(); begin = Clock::now()) {
      renderStep(*step, begin);
      context_.stop.check();
    }
    writer_->finish();
  } catch (const Interrupted&) {
    writer_->finish();
    progress_->finish();
    context_.whenInterrupted = countText(uint64_t(submitted_), "frame") + " of " +
                               std::to_string(framesToWrite()) +
                               " written; the same command with --resume goes on";
    throw;
  }
  progress_->finish();
}

void RenderRun::renderStep(const LoadedStep& step, Clock::time_point begin) {
  warnOfNonFinite(step);
  const bool first = std::holds_alternative<Field>(step.content);
  FrameTimes times;
  times.loadMs = step.loadMs;
  const auto atHand = Clock::now();
  show(step, *renderer_);
  times.renderMs = msSince(atHand);
  times.totalMs = msSince(begin);
  if (verifier_) {
    show(step, *verifier_);
    times.trueRmse = colourError(renderer_->image(), verifier_->image()).rmse;
  }
  if (stands(step.index)) return;
  summary_.add(renderer_->statistics(), times, first);
  writeFrame(step, times);
  progress_->update(++submitted_, framesToWrite());
}

void RenderRun::show(const LoadedStep& step, FrameRenderer& renderer) {
  try {
    if (const auto* field = std::get_if<Field>(&step.content))
      renderer.start(*field);
    else
      renderer.update(std::get<ChangedVoxels>(step.content));
  } catch (const StateError& error) {
    throw StateError(source_->stepName(step.index) + ": " + error.what());
  }
}

std::vector<std::pair<std::string, Image>> RenderRun::aovs() const {
  std::vector<std::pair<std::string, Image>> images;
  for (const FrameRenderer::Aov aov : arguments_.aovs)
    images.emplace_back(FrameRenderer::name(aov), renderer_->aov(aov));
  return images;
}

void RenderRun::writeFrame(const LoadedStep& step, const FrameTimes& times) {
  const FrameStatistics statistics = renderer_->statistics();
  const int64_t number = source_->steps()[step.index];
  FrameToWrite frame{framePathOf(step.index), {}, writer_->spareImage(), {}, aovs(), {}, {}};
  frame.rgba = renderer_->image();
  if (arguments_.output.png) frame.png = pngPathOf(step.index);
  if (arguments_.depth) frame.depth = renderer_->depth();
  frame.metadata = {{"comments", context_.commandLine},
                    {"kairos:version", std::string(KAIROS_VERSION)},
                    {"kairos:step", stepEntry(number)},
                    {"kairos:method", description_.method},
                    {"kairos:samples", double(statistics.samples)},
                    {"kairos:settings", fingerprintOf(step.index)}};
  if (settings_.slabs()) frame.metadata["kairos:preintegrated"] = 1;
  if (settings_.error > 0) frame.metadata["kairos:errorTarget"] = settings_.error;
  if (!arguments_.budgetText.empty()) frame.metadata["kairos:budget"] = arguments_.budgetText;
  if (const auto& error = statistics.error; error && budgeted(arguments_.renderer.method)) {
    frame.metadata["kairos:errorEstimate"] = error->rmse;
    frame.metadata["kairos:errorLow"] = error->low;
    frame.metadata["kairos:errorHigh"] = error->high;
  }
  if (times.trueRmse) frame.metadata["kairos:trueError"] = *times.trueRmse;
  frame.written = [this, times, statistics, number, bytes = step.bytesRead,
                   nonFinite = step.nonFinite](double writeMs) {
    FrameTimes all = times;
    all.writeMs = writeMs;
    stats_->write(frameRecord(number, description_, all, statistics, bytes, nonFinite));
  };
  writer_->submit(std::move(frame));
}

void RenderRun::warnOfNonFinite(const LoadedStep& step) {
  if (step.nonFinite == 0 || warnedOfNonFinite_) return;
  warnedOfNonFinite_ = true;
  progress_->message("kairos: warning: " + source_->stepName(step.index) + " (step " +
                     std::to_string(source_->steps()[step.index]) + ") holds " +
                     countText(uint64_t(step.nonFinite), "NaN or infinite voxel") +
                     ", rendered as absent; --stats counts those of every step");
}

void RenderRun::summarise(Clock::time_point begin) {
  if (arguments_.output.quiet) return;
  const auto kept = size_t(std::count(stands_.begin(), stands_.end(), true));
  const uint64_t memory = renderer_ ? renderer_->memoryBytes() : 0;
  std::fputs(summary_.text(description_, kept, msSince(begin) / 1000, memory).c_str(), stdout);
  std::printf("%s ... %s\n", framePathOf(firstSelected_).c_str(), framePathOf(lastSelected_).c_str());
}

}  // namespace

void addRenderCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command =
      root.add_subcommand("render", "Render one image per time step, recasting only what changed");
  auto arguments = std::make_shared<RenderArguments>();
  arguments->addTo(*command);
  command->callback([arguments, &context] {
    context.run = [arguments, &context] {
      RenderRun(*arguments, context).run();
      return 0;
    };
  });
}

}  // namespace kairos
