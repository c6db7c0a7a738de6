#include "app/published_method_arguments.h"

#include <CLI/CLI.hpp>

#include "app/option_values.h"
#include "app/text_format.h"
#include "core/error.h"

namespace kairos {
namespace {

void needMethod(bool given, bool fits, const char* option, const char* methods) {
  if (given && !fits) throw OptionError(option, std::string("needs --method ") + methods);
}

}  // namespace

void PublishedMethodArguments::addTo(CLI::App& command) {
  const auto add = [&](const char* option, std::string& value, const std::string& help) {
    command.add_option(option, value, help)->group("Method")->option_text("NAME");
  };
  const auto flag = [&](const char* option, bool& value, const char* help) {
    command.add_flag(option, value, help)->group("Method");
  };
  add("--projection", projection_,
      "dvrm, tldvrm, tcdvrm: which pixels a changed voxel influences: those of\nthe paper (paper), or every "
      "one "
      "whose colour it can alter (conservative)\n[conservative]");
  add("--order", order_,
      "with these: the four pixels around the projected voxel (zero), or those\ninside the projection of its "
      "interpolation space (trilinear) [trilinear]");
  add("--lom", lom_,
      "tcdvrm: prefer pixels that many changed voxels influence (influence), or\nthose whose voxels changed "
      "most (magnitude) [influence]");
  flag("--carry-over", carryOver_, "tcdvrm: voxels stay candidates until all their pixels are cast");
  flag("--cut-off", cutOff_, "tcdvrm: end casting when the time is over, whatever was predicted");
  flag("--no-calibration", noCalibration_, "tcdvrm: take the cost of a sample from the first step alone");
}

void PublishedMethodArguments::interpret(RendererOptions& options) const {
  if (!projection_.empty())
    options.projection.mode =
        ProjectionMode(choiceOption("--projection", projection_, {"paper", "conservative"}));
  if (!order_.empty())
    options.projection.order = ProjectionOrder(choiceOption("--order", order_, {"zero", "trilinear"}));
  if (!lom_.empty())
    options.tcdvrm.lom = LevelOfModification(choiceOption("--lom", lom_, {"influence", "magnitude"}));
  options.tcdvrm.carryOver = carryOver_;
  options.tcdvrm.cutOff = cutOff_;
  options.tcdvrm.calibrate = !noCalibration_;
  const bool projects = projectsVoxels(options.method), timeCritical = options.method == Method::tcdvrm;
  needMethod(!projection_.empty(), projects, "--projection", "dvrm, tldvrm or tcdvrm");
  needMethod(!order_.empty(), projects, "--order", "dvrm, tldvrm or tcdvrm");
  needMethod(!lom_.empty(), timeCritical, "--lom", "tcdvrm");
  needMethod(carryOver_, timeCritical, "--carry-over", "tcdvrm");
  needMethod(cutOff_, timeCritical, "--cut-off", "tcdvrm");
  needMethod(noCalibration_, timeCritical, "--no-calibration", "tcdvrm");
}

bool projectsVoxels(Method method) {
  return method == Method::dvrm || method == Method::tldvrm || method == Method::tcdvrm;
}

std::string publishedMethodText(const RendererOptions& options) {
  const bool paper = options.projection.mode == ProjectionMode::paper;
  if (!projectsVoxels(options.method) || (options.method != Method::tcdvrm && !paper)) return {};
  return formatted(" order %d mode %d lom %d carry %d cut %d calibrate %d", int(options.projection.order),
                   int(options.projection.mode), int(options.tcdvrm.lom), int(options.tcdvrm.carryOver),
                   int(options.tcdvrm.cutOff), int(options.tcdvrm.calibrate));
}

}  // namespace kairos
