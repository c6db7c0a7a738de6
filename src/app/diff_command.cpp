// kairos diff: the static phase from the command line.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/input_arguments.h"
#include "app/lattice_info.h"
#include "app/option_values.h"
#include "app/progress_line.h"
#include "app/sequence_summary.h"
#include "app/static_phase.h"
#include "app/text_format.h"
#include "core/error.h"
#include "io/manifest.h"
#include "io/sequence.h"

namespace kairos {

namespace {

namespace fs = std::filesystem;

struct DiffArguments {
  InputArguments input;
  std::string output;
  std::string toleranceText = "0", keyEveryText = "0", threadsText = "0";
  bool overwrite = false, quiet = false;

  double tolerance() const {
    return numberOption("--tolerance", toleranceText, 0, std::numeric_limits<float>::max(),
                        "a number of at least 0");
  }
  int keyEvery() const {
    return int(integerOption("--key-every", keyEveryText, 0, 1000000000,
                             "a whole number from 0 (the first step only)"));
  }
  int threads() const {
    return int(integerOption("--threads", threadsText, 0, 1024, "a whole number from 0 (all) to 1024"));
  }
};

void requireSeparateOutput(const DiffArguments& arguments) {
  for (const std::string& input : arguments.input.inputs()) {
    std::error_code error;
    if (fs::equivalent(input, arguments.output, error))
      throw OptionError("--output",
                        arguments.output + " is an INPUT as well; expected a directory of its own");
  }
}

bool filesArePresent(const SequenceManifest& manifest, const std::string& directory) {
  const auto present = [](const std::string& path, uint64_t bytes) {
    std::error_code error;
    return fs::file_size(path, error) == bytes && !error;
  };
  return std::all_of(manifest.steps.begin(), manifest.steps.end(), [&](const SequenceStep& s) {
    return (!s.key || present(keyPathOf(directory, s.step), s.keyBytes)) &&
           (!s.differential || present(differentialPathOf(directory, s.step), s.differentialBytes));
  });
}

/// The first input that was written after the sequence's manifest, which hints at a simulation that was run
/// again.
std::string inputNewerThan(const InputSeries& input, const std::string& directory) {
  std::error_code error;
  const auto written = fs::last_write_time(manifestPath(directory), error);
  if (error) return {};
  for (const StepFile& file : input.steps())
    if (const auto changed = fs::last_write_time(file.path, error); !error && changed > written)
      return file.path;
  return {};
}

/// What stands in the output directory: nothing, an interrupted run to go on with, or this very sequence,
/// finished. Throws OutputError for anything that only --overwrite may replace.
enum class Found { nothing, interrupted, complete };

Found examineOutput(const DiffArguments& arguments, const SequenceManifest& wanted) {
  if (arguments.overwrite || !isSequence(arguments.output)) return Found::nothing;
  const SequenceManifest found = readManifest(arguments.output);
  const std::string difference = manifestDifference(found, wanted);
  if (!difference.empty())
    throw OutputError(arguments.output,
                      "holds another sequence, with " + difference + "; --overwrite replaces it");
  if (!found.complete) return Found::interrupted;
  if (!filesArePresent(found, arguments.output))
    throw OutputError(
        arguments.output,
        "holds this sequence, but files of it are missing or have another size (see kairos info "
        "--verify); --overwrite makes it anew");
  return Found::complete;
}

uint64_t inputBytes(const InputSeries& input, size_t first) {
  uint64_t bytes = 0;
  for (size_t i = first; i < input.steps().size(); ++i) bytes += input.bytes(i);
  return bytes;
}

void printSummary(const DiffArguments& arguments, const InputSeries& input, const SequenceManifest& manifest,
                  size_t resumedAt, double seconds) {
  const SequenceSummary summary = summarise(manifest);
  const double all = double(inputBytes(input, 0)), read = double(inputBytes(input, resumedAt));
  std::cout << arguments.output << ": " << countText(manifest.steps.size(), "step") << ", "
            << manifest.steps.front().step << " to " << manifest.steps.back().step << ", "
            << countText(summary.keyFrames, "key frame") << "\n"
            << infoLine("changes", changesText(summary))
            << infoLine("size", byteText(double(summary.bytes)) + " from " + byteText(all) + " of input (" +
                                    percentText(double(summary.bytes) / std::max(1.0, all)) + ")" +
                                    bytesPerVoxelText(summary))
            << infoLine("NaN, Inf", nonFiniteText(summary))
            << infoLine("time", durationText(seconds) + " for " +
                                    countText(manifest.steps.size() - resumedAt, "step") + ", " +
                                    byteText(read / std::max(seconds, 1e-9)) + "/s of input");
}

void reportComplete(const DiffArguments& arguments, const InputSeries& input) {
  if (const std::string newer = inputNewerThan(input, arguments.output); !newer.empty())
    std::cerr << "warning: " << newer << " is newer than the sequence; --overwrite makes it anew\n";
  if (!arguments.quiet)
    std::cout << arguments.output << ": already complete, " << countText(input.steps().size(), "step")
              << "\n";
}

/// The stages report from threads of their own.
StaticPhaseReports reportsTo(ProgressLine& progress, std::mutex& mutex, size_t done) {
  return {[&, done](int64_t finished, int64_t total) {
            const std::lock_guard lock(mutex);
            progress.update(finished - int64_t(done), total - int64_t(done));
          },
          [&](const std::string& line) {
            const std::lock_guard lock(mutex);
            progress.message(line);
          }};
}

int runDiff(const DiffArguments& arguments, CommandContext& context) {
  const auto start = std::chrono::steady_clock::now();
  ThreadPool pool(arguments.threads());
  const double tolerance = arguments.tolerance();
  const int keyEvery = arguments.keyEvery();
  requireSeparateOutput(arguments);
  const std::unique_ptr<InputSeries> input = arguments.input.open();
  const SequenceManifest wanted = emptyManifest(*input, tolerance, keyEvery);
  if (examineOutput(arguments, wanted) == Found::complete) {
    reportComplete(arguments, *input);
    return 0;
  }
  const std::string count = countText(input->steps().size(), "step");
  SequenceWriter writer(arguments.output, wanted, arguments.overwrite);
  const std::vector<SequenceStep> kept = writer.manifest().steps;
  ProgressLine progress("diff", "steps", arguments.quiet);
  std::mutex progressMutex;
  if (!kept.empty() && !arguments.quiet)
    progress.message(arguments.output + ": going on after step " + std::to_string(kept.back().step) + ", " +
                     std::to_string(kept.size()) + " of " + count + " done");
  try {
    runStaticPhase(*input, writer, arguments.output, pool, context.stop,
                   reportsTo(progress, progressMutex, kept.size()));
  } catch (const Interrupted&) {
    context.whenInterrupted = std::to_string(writer.manifest().steps.size()) + " of " + count +
                              " done, the same command goes on from there";
    throw;
  }
  progress.finish();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!arguments.quiet) printSummary(arguments, *input, writer.manifest(), kept.size(), seconds);
  return 0;
}

}  // namespace

void addDiffCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command = root.add_subcommand(
      "diff", "Turn a simulation's time series into a sequence: key frames and changed voxels");
  const auto arguments = std::make_shared<DiffArguments>();
  arguments->input.addTo(
      *command,
      "The simulation's files: .vdb or raw; names, a directory, a glob, or a pattern with #### or %04d");
  command->add_option("-o,--output", arguments->output, "Directory of the sequence; made if needed")
      ->required()
      ->type_name("SEQ");
  command
      ->add_option("--tolerance", arguments->toleranceText,
                   "A voxel changes when it is more than E from what was stored last, so no step is ever "
                   "more than E off [0: exact]")
      ->type_name("E");
  command
      ->add_option("--key-every", arguments->keyEveryText,
                   "Key frame every N steps, for seeking [0: the first step only]")
      ->type_name("N");
  command
      ->add_option("--threads", arguments->threadsText,
                   "Threads that compare [0: all]; reading and writing go on beside them")
      ->type_name("N");
  command->add_flag("--overwrite", arguments->overwrite, "Replace a sequence that is there already");
  command->add_flag("--quiet", arguments->quiet, "Print errors and warnings only");
  command->footer(
      "An interrupted run goes on where it stopped when the same command is given again.\n\n"
      "Examples:\n"
      "  kairos diff smoke/ -o smoke.seq                                  the .vdb files of a directory\n"
      "  kairos diff 'smoke/*.vdb' --grid temperature --tolerance 0.01 -o smoke.seq\n"
      "  kairos diff 'jet1_####.raw' --dims 81,49,65 --type u8 -o jet1.seq");
  command->callback([&context, arguments] {
    context.run = [&context, arguments] { return runDiff(*arguments, context); };
  });
}

}  // namespace kairos
