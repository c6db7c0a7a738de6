// INPUT... and the options that say what is in it: shared by every command that reads a time series.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/input_series.h"

namespace CLI {
class App;
}

namespace kairos {

class InputArguments {
 public:
  /// Adds INPUT..., --grid, --dims, --type and --voxel-size. `this` must outlive the parsing.
  void addTo(CLI::App& command, const std::string& inputHelp);

  const std::vector<std::string>& inputs() const { return inputs_; }

  /// Is the one and only INPUT a sequence, that is a directory with a sequence.json?
  bool isSequence() const;
  /// That directory. Throws OptionError where an option was given that only simulation files need, or
  /// InputError where a sequence stands among other inputs.
  std::string sequenceDirectory() const;

  /// What the options say. Throws OptionError where they contradict each other.
  InputOptions options() const;
  /// Opens the simulation's files. Throws OptionError and InputError, also when an INPUT is a sequence.
  std::unique_ptr<InputSeries> open() const;

 private:
  std::vector<std::string> inputs_;
  std::string grid_, dims_, type_, voxelSize_;
};

}  // namespace kairos
