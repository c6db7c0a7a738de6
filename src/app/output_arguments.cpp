#include "app/output_arguments.h"

#include <CLI/CLI.hpp>

namespace kairos {

void OutputArguments::addTo(CLI::App& command, const std::string& statsHelp) {
  const char* const kGroup = "Output";
  command.add_option("-o,--output", pattern, "EXR files to write, #### for the time step (required)")
      ->group(kGroup)
      ->option_text("PATTERN")
      ->required();
  command.add_option("--frames", framesText, "time steps to render: A-B, A, A- or -B [all]")
      ->group(kGroup)
      ->option_text("A-B");
  auto* half =
      command.add_flag("--half", half_, "16-bit float colour [this]")->group(kGroup)->option_text(" ");
  command.add_flag("--float", full_, "32-bit float colour")->group(kGroup)->excludes(half)->option_text(" ");
  command.add_option("--compression", compression_, "zip, zips, piz or none; all lossless [zip]")
      ->group(kGroup)
      ->option_text("NAME");
  command.add_flag("--png", png, "also a PNG beside each EXR, over black")->group(kGroup);
  command.add_option("--stats", stats, statsHelp)->group(kGroup)->option_text("FILE.jsonl");
  command.add_flag("--quiet", quiet, "no progress, no summary")->group(kGroup);
}

void OutputArguments::interpret() {
  if (!framesText.empty()) frames = stepRangeOption("--frames", framesText);
  exr.half = !full_;
  if (!compression_.empty())
    exr.compression =
        ExrCompression(choiceOption("--compression", compression_, {"none", "zips", "zip", "piz"}));
}

void OutputArguments::check() const {
  const bool oneStep = !framesText.empty() && framesText.find_first_not_of("0123456789") == std::string::npos;
  checkOutputPattern(pattern, oneStep);
}

}  // namespace kairos
