#include "app/render_arguments.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <thread>

#include "core/error.h"
#include "raycast/tile_kernel.h"

namespace kairos {
namespace {

constexpr const char* kExamples = R"(Examples:
  kairos render seq/ -o out/frame.####.exr --png
  kairos render seq/ -o out/side.####.exr --view x --size 1920x1080 --tf magma --shade --step 0.5
  kairos render sim/smoke_####.vdb -o out/frame.####.exr --frames 21-40 --range 0,1.2
  kairos render 'jet_*.raw' --dims 81,49,65 --type u8 -o out/mip.####.exr --mode mip --ortho fit

The first frame is rendered in full; for each further step only what its changed voxels touch is recast, with the same
bits as a full render. INPUT is a sequence made by 'kairos diff', or a simulation's files (OpenVDB or raw): a directory, a glob, a #### or %04d
pattern, or file names. #### in the output name becomes the time step. Images are premultiplied linear RGBA, row 0 at the
top; cameras and lengths are in world units; NaN and infinite voxels are rendered as absent.
--stats: total_ms is from waiting for the step to its image, load_ms the reading of it (which runs ahead), write_ms the
writing of its files (which runs behind). Ctrl-C stops after the current frame; --resume goes on where it stopped.)";

constexpr uint64_t kDefaultCache = uint64_t(2) << 30;

std::vector<std::string> isaNames() {
  std::vector<std::string> names;
  for (const Isa isa : supportedIsas()) names.push_back(name(isa));
  names.push_back(name(Isa::scalar));
  return names;
}

Isa interpretIsa(const std::string& text) {
  if (text.empty() || text == "auto") return Isa::automatic;
  for (const Isa isa : supportedIsas())
    if (text == name(isa)) return isa;
  if (text == name(Isa::scalar)) return Isa::scalar;
  std::vector<std::string> names = isaNames();
  names.insert(names.begin(), "auto");
  choiceOption("--isa", text, names);
  return Isa::automatic;
}

}  // namespace

void RenderArguments::addTo(CLI::App& command) {
  input.addTo(command, "a sequence directory, or a simulation's files");
  command.get_option("INPUT")->option_text(" ");
  command
      .add_option(
          "--tolerance", words_.tolerance,
          "simulation files: a voxel has changed when it differs by more than this\nfrom what is shown [0]")
      ->group("Input")
      ->option_text("E");
  view.addTo(command);
  addMethodOptions(command);
  addOutputOptions(command);
  command.footer(kExamples);
}

void RenderArguments::addMethodOptions(CLI::App& command) {
  const auto add = [&](const char* option, const char* placeholder, std::string& value,
                       const std::string& help) {
    command.add_option(option, value, help)->group("Method")->option_text(placeholder);
  };
  add("--method", "NAME", words_.method,
      "exact, the same bits: segments (recast the ray segments whose voxels\nchanged), full (recast "
      "everything), dvrm, tldvrm (whole rays, as published);\nas near as --budget allows: anytime (exact "
      "where "
      "that fits, else adaptive\nrefinement), tcdvrm (as published), tiles (recast the tiles that seem to\n"
      "change most), lowres (a coarser image enlarged) [segments; with a budget\nanytime]");
  add("--budget", "BUDGET", budgetText,
      "what a frame may cost, from its step to its image: 40ms, 25fps, or\nsamples:2e6; or how wrong it may "
      "be: "
      "error:1e-3 (RMSE to the exact frame;\nanytime alone). With the last two, runs repeat bit for bit "
      "[none]");
  add("--seed", "N", words_.seed, "of what is drawn at random [0]");
  published_.addTo(command);
  command.add_flag("--verify", verify, "render each frame exactly too, and report how far it was off")
      ->group("Method");
  add("--threads", "N", words_.threads, "threads that render, from 1 to 1024 [all processors]");
  std::string isas;
  for (const std::string& known : isaNames()) isas += ", " + known;
  add("--isa", "NAME", words_.isa,
      "instruction set of the kernels: auto" + isas + " [auto: the\nbest of this machine]");
  add("--cache-memory", "SIZE", words_.cacheMemory,
      "most memory for reusable ray segments, with KiB, MiB or GiB; rays that\ndo not fit are recast whole "
      "[2GiB]");
}

void RenderArguments::addOutputOptions(CLI::App& command) {
  output.addTo(command, "one JSON object per frame: times, counts, what was reused");
  command
      .add_option(
          "--aov", words_.aov,
          "further channels, separated by commas: depth (Z: the opacity-weighted mean\ndistance from the eye "
          "in world units, infinite where nothing is seen;\nnot under a budget, dvr), error (expected, per "
          "pixel), age (steps since a\npixel was cast), level (stride in pixels of the rays around it), "
          "influence\n(changed voxels that touch it; dvrm, tldvrm, tcdvrm), samples (along its\nray) [none]")
      ->group("Output")
      ->option_text("NAMES");
  command.add_flag("--resume", resume, "skip frames that an earlier run with the same settings finished")
      ->group("Output");
}

void RenderArguments::interpret() {
  view.interpret();
  interpretMethod();
  output.interpret();
  interpretAovs();
}

void RenderArguments::interpretMethod() {
  const Words& w = words_;
  if (!w.tolerance.empty())
    tolerance = numberOption("--tolerance", w.tolerance, 0, 1e30,
                             "a number of 0 or more, in the units of the values");
  interpretBudget();
  renderer.threads =
      w.threads.empty()
          ? std::clamp(int(std::thread::hardware_concurrency()), 1, 1024)
          : int(integerOption("--threads", w.threads, 1, 1024, "a whole number from 1 to 1024"));
  renderer.cacheMemory = w.cacheMemory.empty() ? kDefaultCache : bytesOption("--cache-memory", w.cacheMemory);
  isa = interpretIsa(w.isa);
}

void RenderArguments::interpretBudget() {
  static const std::vector<Method> kMethods{Method::full,    Method::segments, Method::dvrm,  Method::tldvrm,
                                            Method::anytime, Method::tcdvrm,   Method::tiles, Method::lowres};
  std::vector<std::string> names;
  for (const Method method : kMethods) names.push_back(name(method));
  if (!budgetText.empty()) {
    renderer.budget = budgetOption("--budget", budgetText);
    renderer.method = Method::anytime;
  }
  if (!words_.method.empty()) renderer.method = kMethods[choiceOption("--method", words_.method, names)];
  if (renderer.budget.limited() && !budgeted(renderer.method))
    throw OptionError(
        "--budget",
        std::string("--method ") + name(renderer.method) +
            " takes what an exact image takes, expected --method anytime, tcdvrm, tiles or lowres");
  if (renderer.budget.limited() && !takes(renderer.method, renderer.budget))
    throw OptionError("--budget", std::string("--method ") + name(renderer.method) +
                                      " cannot stop at an error, expected --method anytime");
  published_.interpret(renderer);
  if (!words_.seed.empty())
    renderer.seed =
        uint64_t(integerOption("--seed", words_.seed, 0, INT64_MAX, "a whole number of 0 or more"));
}

void RenderArguments::interpretAovs() {
  if (words_.aov.empty()) return;
  for (const std::string& word : commaSeparated(words_.aov)) {
    const size_t aov =
        choiceOption("--aov", word, {"error", "age", "level", "influence", "samples", "depth"});
    if (aov == 5)
      depth = true;
    else
      aovs.push_back(FrameRenderer::Aov(aov));
  }
}

}  // namespace kairos
