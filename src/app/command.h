// How the commands of `kairos` hang together: each file adds one CLI11 subcommand whose callback stores what
// to run.
#pragma once

#include <functional>
#include <string>

#include "core/progress.h"

namespace CLI {
class App;
}

namespace kairos {

/// What every command gets from main.
struct CommandContext {
  StopFlag& stop;            // set by Ctrl-C and SIGTERM
  std::string commandLine;   // as typed, for image metadata
  std::function<int()> run;  // set by the chosen command's callback; returns the exit code
  std::string
      whenInterrupted;  // what to tell the user after Ctrl-C, for example how to go on; set by the command
};

void addDiffCommand(CLI::App& root, CommandContext& context);
void addInfoCommand(CLI::App& root, CommandContext& context);
void addRenderCommand(CLI::App& root, CommandContext& context);
void addCompareCommand(CLI::App& root, CommandContext& context);
void addBenchCommand(CLI::App& root, CommandContext& context);
/// Only where the program was built with OpenGL (KAIROS_LOD).
void addLodCommand(CLI::App& root, CommandContext& context);

}  // namespace kairos
