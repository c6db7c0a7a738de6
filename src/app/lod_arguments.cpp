#include "app/lod_arguments.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <thread>

#include "core/error.h"

namespace kairos {
namespace {

constexpr const char* kExamples = R"(Examples:
  kairos lod seq/ -o out/frame.####.exr --png --budget 40ms
  kairos lod seq/ -o out/frame.####.exr --budget 25fps --importance gaze --gaze 300,200
  kairos lod head.raw --dims 256,256,145 --type f32 -o out/head.####.exr --importance distance,area --budget 0.1s
  kairos lod seq/ -o out/full.####.exr                    every subvolume at its finest level

The volume is divided into subvolumes with several levels of detail each, rendered as slices of 3D textures through
OpenGL, on a GPU or, without one, on Mesa's llvmpipe. With --budget each subvolume gets a share of the frame's time
by its importance and is rendered at the level that is predicted to take the closest to it (Li and Shen 2002). A playing
sequence loads only the textures whose voxels changed. The budget is for rendering: reading steps and writing files go on beside it.)";

const std::vector<std::string> kMethodNames{"fragments", "slices", "feedback", "tolerance", "none"};
const std::vector<std::string> kImportanceNames{"uniform", "opacity", "distance", "area", "gaze"};

// "40ms", "0.04s" or "25fps".
double interpretBudget(const std::string& text) {
  const std::string expected = "a time such as 40ms or 0.04s, or a rate such as 25fps";
  const size_t unit = text.find_first_not_of("0123456789.eE+-");
  const std::optional<double> number = parsedNumber(text.substr(0, unit));
  if (unit == std::string::npos || !number || !(*number > 0)) refuseValue("--budget", text, expected);
  const std::string name = text.substr(unit);
  if (name != "ms" && name != "s" && name != "fps") refuseValue("--budget", text, expected);
  return name == "ms" ? *number / 1000 : name == "s" ? *number : 1 / *number;
}

// Some dozens of subvolumes, whatever the size of the volume.
uint64_t defaultSubvolumeMemory(const Lattice& lattice) {
  constexpr uint64_t kSubvolumes = 32, kBytesPerTexel = 4, kSmallest = uint64_t(64) << 10,
                     kLargest = uint64_t(4) << 20;
  return std::clamp(uint64_t(lattice.domain.voxelCount()) * kBytesPerTexel / kSubvolumes, kSmallest,
                    kLargest);
}

}  // namespace

void LodArguments::addTo(CLI::App& command) {
  input.addTo(command, "a sequence directory, or a simulation's files");
  command.get_option("INPUT")->option_text(" ");
  view.addTo(command);
  addTimeOptions(command);
  addVolumeOptions(command);
  output.addTo(command, "one JSON object per frame: times, counts, levels");
  command.footer(kExamples);
}

void LodArguments::addTimeOptions(CLI::App& command) {
  const auto add = [&](const char* option, const char* placeholder, std::string& value, const char* help) {
    command.add_option(option, value, help)->group("Time")->option_text(placeholder);
  };
  add("--budget", "TIME", words_.budget,
      "time for each frame: 40ms, 0.04s or 25fps [none: the finest levels]");
  add("--controller", "NAME", words_.controller,
      "how levels are chosen. Against the clock: fragments (time goes with the\nfragments drawn), slices "
      "(with "
      "the number of slices). To compare with:\nfeedback (a tolerance adjusted from frame to frame), "
      "tolerance "
      "(a fixed\none), none (the finest levels) [with --budget fragments, else none]");
  add("--importance", "NAME[:W],...", words_.importance,
      "what deserves time: uniform, opacity, distance, area, gaze, or several\nwith weights [uniform]");
  add("--gaze", "X,Y", words_.gaze, "with gaze: where somebody looks, in pixels [the image's centre]");
  add("--lod-tolerance", "E", words_.tolerance,
      "controllers tolerance and feedback: what a subvolume may lose, as a\nstandard deviation relative to "
      "the "
      "range of the transfer function [0.01]");
  add("--coherence", "PERCENT", words_.coherence,
      "keep a subvolume's level while its importance changes by less [0]");
}

void LodArguments::addVolumeOptions(CLI::App& command) {
  const auto add = [&](const char* option, const char* placeholder, std::string& value, const char* help) {
    command.add_option(option, value, help)->group("Textures")->option_text(placeholder);
  };
  add("--texture-memory", "SIZE", words_.textureMemory, "most memory for textures [256MiB]");
  add("--subvolume-memory", "SIZE", words_.subvolumeMemory,
      "subvolumes whose texture would be larger are split [64KiB to 4MiB, for\nsome dozens of them]");
  add("--subvolume-deviation", "D", words_.subvolumeDeviation,
      "and those whose values' standard deviation is larger, in the\nvalues' units [never]");
  add("--slices", "NAME", words_.slices,
      "planes across the view, or shells: spheres about the eye, where kairos\nrender takes its samples "
      "[planes]");
  add("--blend", "NAME", words_.blend, "front-to-back or back-to-front [front-to-back]");
  add("--platform", "NAME", words_.platform,
      "where OpenGL comes from: auto, hardware, surfaceless or software [auto]");
  add("--threads", "N", words_.threads, "threads that prepare the volume, from 1 to 1024 [all processors]");
}

void LodArguments::interpret() {
  view.interpret();
  interpretTime();
  interpretVolume();
  output.interpret();
}

void LodArguments::interpretTime() {
  const Words& w = words_;
  if (!w.budget.empty()) budgetSeconds = interpretBudget(w.budget);
  if (!w.controller.empty())
    method = LodMethod(choiceOption("--controller", w.controller, kMethodNames));
  else
    method = budgetSeconds > 0 ? LodMethod::fragments : LodMethod::none;
  const bool timed = method != LodMethod::none && method != LodMethod::tolerance;
  if (timed && budgetSeconds == 0)
    throw OptionError("--controller", w.controller + " needs --budget TIME as well");
  if (!timed && budgetSeconds > 0)
    throw OptionError("--budget", "is not kept by --controller " + w.controller);
  for (const std::string& word : commaSeparated(w.importance.empty() ? "uniform" : w.importance)) {
    const size_t colon = word.find(':');
    const std::string name = word.substr(0, colon);
    choiceOption("--importance", name, kImportanceNames);
    importances_.push_back({name, colon == std::string::npos
                                      ? 1
                                      : numberOption("--importance", word.substr(colon + 1), 0, 1e6,
                                                     "a weight of 0 or more after the colon")});
  }
  if (!w.gaze.empty()) {
    const auto xy = numbersOption("--gaze", w.gaze, 2, "an image position X,Y in pixels");
    gaze_ = Vec3d{xy[0], xy[1], 0};
    if (std::none_of(importances_.begin(), importances_.end(),
                     [](const auto& part) { return part.first == "gaze"; }))
      throw OptionError("--gaze", "needs --importance gaze as well");
  }
  if (!w.tolerance.empty())
    tolerance_ = numberOption("--lod-tolerance", w.tolerance, 1e-9, 1e9, "a number above 0");
  if (!w.coherence.empty())
    coherence_ = numberOption("--coherence", w.coherence, 0, 100, "percent from 0 to 100") / 100;
}

void LodArguments::interpretVolume() {
  const Words& w = words_;
  if (!w.textureMemory.empty()) base_.textureMemory = bytesOption("--texture-memory", w.textureMemory);
  if (!w.subvolumeMemory.empty())
    base_.subdivision.memoryLimit = bytesOption("--subvolume-memory", w.subvolumeMemory);
  base_.subdivision.memoryLimit = std::min(base_.subdivision.memoryLimit, base_.textureMemory);
  if (!w.subvolumeDeviation.empty())
    base_.subdivision.deviationThreshold =
        numberOption("--subvolume-deviation", w.subvolumeDeviation, 0, 1e300, "a number of 0 or more");
  if (!w.slices.empty()) base_.shape = SliceShape(choiceOption("--slices", w.slices, {"planes", "shells"}));
  if (!w.blend.empty())
    base_.order = BlendOrder(choiceOption("--blend", w.blend, {"front-to-back", "back-to-front"}));
  if (!w.platform.empty())
    platform =
        GlPlatform(choiceOption("--platform", w.platform, {"auto", "hardware", "surfaceless", "software"}));
  threads = w.threads.empty()
                ? std::clamp(int(std::thread::hardware_concurrency()), 1, 1024)
                : int(integerOption("--threads", w.threads, 1, 1024, "a whole number from 1 to 1024"));
}

LodSettings LodArguments::settings(const RenderSettings& picture, const Lattice& lattice) const {
  if (picture.filter != Filter::trilinear)
    throw OptionError("--filter", "kairos lod interpolates trilinearly only");
  if (picture.mode == RenderMode::average)
    throw OptionError("--mode", "kairos lod renders dvr and mip; average is for kairos render");
  if (picture.shade) throw OptionError("--shade", "is for kairos render");
  if (picture.clipBox) throw OptionError("--clip-box", "is for kairos render");
  if (picture.terminate != RenderSettings{}.terminate)
    throw OptionError("--terminate", "is for kairos render: slices blend through the whole volume");
  LodSettings settings = base_;
  if (words_.subvolumeMemory.empty())
    settings.subdivision.memoryLimit = std::min(settings.textureMemory, defaultSubvolumeMemory(lattice));
  settings.width = picture.width;
  settings.height = picture.height;
  settings.transferFunction = picture.transferFunction;
  settings.range = picture.range;
  settings.unitDistance = picture.unitDistance;
  settings.step = picture.step;
  settings.mode = picture.mode == RenderMode::mip ? LodMode::mip : LodMode::dvr;
  if (method == LodMethod::slices) settings.lodsPerLevel = 1;  // the paper's ladder
  settings.validate();
  return settings;
}

Importance LodArguments::importance(const RenderSettings& picture) const {
  const Vec3d gaze = gaze_.value_or(Vec3d{0.5 * picture.width, 0.5 * picture.height, 0});
  const double radius = kGazeRadius * std::hypot(picture.width, picture.height);
  const auto named = [&](const std::string& name) {
    if (name == "opacity") return opacityImportance();
    if (name == "distance") return distanceImportance();
    if (name == "area") return areaImportance();
    if (name == "gaze") return gazeImportance(gaze.x, gaze.y, radius);
    return uniformImportance();
  };
  if (importances_.size() == 1) return named(importances_.front().first);
  std::vector<WeightedImportance> parts;
  for (const auto& [name, weight] : importances_) parts.push_back({named(name), weight});
  return mixedImportance(std::move(parts));
}

std::unique_ptr<LodController> LodArguments::controller(const RenderSettings& picture,
                                                        const LodProfile& profile) const {
  const double tolerance = tolerance_ * (double(picture.range.hi) - double(picture.range.lo));
  PredictiveOptions options;
  options.coherence = coherence_;
  options.secondsPerVoxel = profile.secondsPerVoxel;
  switch (method) {
    case LodMethod::fragments:
      options.secondsPerUnit = profile.secondsPerFragment;
      return makePredictiveController(options);
    case LodMethod::slices:
      options.unit = PredictiveOptions::Unit::slices;
      options.secondsPerUnit = profile.secondsPerSlice;
      return makePredictiveController(options);
    case LodMethod::feedback:
      return makeFeedbackController(tolerance);
    case LodMethod::tolerance:
      return makeToleranceController(tolerance);
    default:
      return makeFinestController();
  }
}

const char* LodArguments::methodName() const {
  return kMethodNames[size_t(method)].c_str();
}

}  // namespace kairos
