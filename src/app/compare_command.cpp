// kairos compare: how far two images or animations are apart.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/frame_comparison.h"
#include "app/option_values.h"
#include "app/progress_line.h"
#include "app/text_format.h"

namespace kairos {

namespace {

using Json = nlohmann::ordered_json;

struct CompareArguments {
  std::string a, b, failRmse;
  std::string threadsText = "0";
  bool json = false;

  double limit() const {
    if (failRmse.empty()) return std::numeric_limits<double>::infinity();
    return numberOption("--fail-rmse", failRmse, 0, std::numeric_limits<double>::max(),
                        "a number of at least 0");
  }
  int threads() const {
    return int(integerOption("--threads", threadsText, 0, 1024, "a whole number from 0 (all) to 1024"));
  }
};

std::string row(const std::string& label, const ImageDifference& d) {
  return formatted("%10s  %11.5g %11.5g %8.2f %9.6f %9.6f\n", label.c_str(), d.rmse, d.max, d.psnr, d.ssim,
                   d.flip);
}

std::string report(const std::vector<ComparedFrame>& frames, const ComparisonSummary& summary) {
  std::string text =
      formatted("%10s  %11s %11s %8s %9s %9s\n", "frame", "RMSE", "max", "PSNR", "SSIM", "FLIP");
  for (const ComparedFrame& f : frames) text += row(std::to_string(f.frames.step), f.difference);
  if (frames.size() > 1) text += row("mean", summary.mean);
  if (summary.different == 0) return text + countText(frames.size(), "frame") + ", all equal\n";
  return text + countText(summary.different, "frame") + " of " + std::to_string(frames.size()) +
         (summary.different == 1 ? " differs" : " differ") + "; worst is " + frames[summary.worst].frames.a +
         "\n";
}

/// JSON has no infinity: null stands for it.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json differenceJson(const ImageDifference& d) {
  return {{"rmse", number(d.rmse)},
          {"max", number(d.max)},
          {"psnr", number(d.psnr)},
          {"ssim", number(d.ssim)},
          {"flip", number(d.flip)}};
}

Json json(const std::vector<ComparedFrame>& frames, const ComparisonSummary& summary, bool passed) {
  Json j;
  j["frames"] = Json::array();
  for (const ComparedFrame& f : frames) {
    Json frame{
        {"step", f.frames.step}, {"a", f.frames.a}, {"b", f.frames.b}, {"equal", f.difference.max == 0}};
    frame.update(differenceJson(f.difference));
    j["frames"].push_back(frame);
  }
  j["summary"] = differenceJson(summary.mean);
  j["summary"]["frames"] = frames.size();
  j["summary"]["frames_different"] = summary.different;
  j["summary"]["worst_step"] = frames[summary.worst].frames.step;
  j["summary"]["worst_rmse"] = number(frames[summary.worst].difference.rmse);
  j["passed"] = passed;
  return j;
}

int runCompare(const CompareArguments& arguments, const StopFlag& stop) {
  const double limit = arguments.limit();
  ThreadPool pool(arguments.threads());
  const std::vector<FramePair> pairs = matchFrames(arguments.a, arguments.b);
  ProgressLine progress("compare", "frames", pairs.size() == 1);
  const auto frames =
      compareFrames(pairs, pool, stop, [&](int64_t done, int64_t total) { progress.update(done, total); });
  progress.finish();
  const ComparisonSummary summary = summarise(frames);
  const bool limited = !arguments.failRmse.empty();
  const bool passed = !limited || frames[summary.worst].difference.rmse <= limit;
  if (arguments.json) {
    std::cout << json(frames, summary, passed).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    std::cout << report(frames, summary);
    if (limited)
      std::cout << "largest RMSE " << formatted("%.5g", frames[summary.worst].difference.rmse)
                << (passed ? " is within " : " exceeds ") << "--fail-rmse " << arguments.failRmse << "\n";
  }
  return passed ? 0 : 1;
}

}  // namespace

void addCompareCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command = root.add_subcommand("compare", "Measure how far two images or animations are apart");
  const auto arguments = std::make_shared<CompareArguments>();
  command->add_option("A", arguments->a, "An image, or a pattern with ####, %04d or wildcards (in quotes)")
      ->required();
  command
      ->add_option("B", arguments->b,
                   "What to compare it with, likewise; frames belong together by their number")
      ->required();
  command->add_option("--fail-rmse", arguments->failRmse, "Exit code 1 when any frame's RMSE is above X")
      ->type_name("X");
  command->add_option("--threads", arguments->threadsText, "Threads [0: all]")->type_name("N");
  command->add_flag("--json", arguments->json,
                    "Machine-readable, with keys that stay; null stands for infinity");
  command->footer(
      "RMSE and max are over the four premultiplied linear channels; PSNR is against a peak of 1; SSIM and "
      "FLIP are of the\n"
      "images as displayed, over black. The mean row's PSNR is that of the mean squared error, its max the "
      "largest.\n\n"
      "Example:\n"
      "  kairos compare 'out/frame.####.exr' 'reference/frame.####.exr' --fail-rmse 1e-4");
  command->callback([&context, arguments] {
    context.run = [&context, arguments] { return runCompare(*arguments, context.stop); };
  });
}

}  // namespace kairos
