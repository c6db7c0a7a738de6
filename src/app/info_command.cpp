// kairos info: what a sequence or a simulation's files hold.
#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/input_arguments.h"
#include "app/lattice_info.h"
#include "app/progress_line.h"
#include "app/sequence_check.h"
#include "app/sequence_info.h"
#include "app/series_info.h"
#include "app/text_format.h"
#include "core/error.h"

namespace kairos {

namespace {

using Json = nlohmann::ordered_json;

struct InfoArguments {
  InputArguments input;
  bool json = false, verify = false;
};

constexpr int kDamaged = 1;

/// The outcome of --verify at the end of the report; the exit code.
int finishReport(const InfoArguments& arguments, Json report, std::string text, size_t steps,
                 const std::vector<std::string>& problems) {
  if (arguments.verify) {
    report["verified"] = {{"sound", problems.empty()}, {"steps_rebuilt", steps}, {"problems", problems}};
    text += "\n";
    text += problems.empty()
                ? infoLine("verified", "sound: " + countText(steps, "step") + " read and rebuilt")
                : infoLine("verified", "DAMAGED: " + countText(problems.size(), "problem") + ", " +
                                           countText(steps, "step") + " could be rebuilt");
    for (const std::string& problem : problems) text += "    " + problem + "\n";
  }
  if (arguments.json) text = report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  std::cout << text;
  return problems.empty() ? 0 : kDamaged;
}

int infoOfSequence(const InfoArguments& arguments, const StopFlag& stop) {
  const SequenceReader reader(arguments.input.sequenceDirectory());
  SequenceCheck check;
  if (arguments.verify) {
    ProgressLine progress("verify", "steps", false);
    check = checkSequence(reader, stop, [&](int64_t done, int64_t total) { progress.update(done, total); });
  }
  return finishReport(arguments, sequenceJson(reader), sequenceText(reader), check.stepsRebuilt,
                      check.problems);
}

int infoOfSeries(const InfoArguments& arguments, const StopFlag& stop) {
  SeriesInfo info = findSeries(arguments.input.inputs(), arguments.input.options());
  if (arguments.verify) {
    ProgressLine progress("verify", "steps", false);
    readAll(info, stop, [&](int64_t done, int64_t total) { progress.update(done, total); });
  }
  return finishReport(arguments, seriesJson(info), seriesText(info), info.statistics.size(), info.problems);
}

}  // namespace

void addInfoCommand(CLI::App& root, CommandContext& context) {
  CLI::App* command = root.add_subcommand("info", "Show what a sequence or a simulation's files hold");
  const auto arguments = std::make_shared<InfoArguments>();
  arguments->input.addTo(*command, "A sequence's directory, or a simulation's files as for kairos diff");
  command->add_flag("--json", arguments->json, "Machine-readable, with keys that stay");
  command->add_flag(
      "--verify", arguments->verify,
      "Read everything again, check every checksum and rebuild every step; exit code 1 when damaged");
  command->footer(
      "Examples:\n"
      "  kairos info jet1.seq/ --verify\n"
      "  kairos info smoke/ --grid temperature\n"
      "  kairos info 'jet1_####.raw' --dims 81,49,65 --type u8");
  command->callback([&context, arguments] {
    context.run = [&context, arguments] {
      return arguments->input.isSequence() ? infoOfSequence(*arguments, context.stop)
                                           : infoOfSeries(*arguments, context.stop);
    };
  });
}

}  // namespace kairos
