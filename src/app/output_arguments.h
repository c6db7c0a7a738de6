// Options that say which frames are rendered and into what files.
#pragma once

#include <string>

#include "app/option_values.h"
#include "io/image_file.h"

namespace CLI {
class App;
}

namespace kairos {

class OutputArguments {
 public:
  /// Adds the options; `statsHelp` is that of --stats. `this` must outlive the parsing.
  void addTo(CLI::App& command, const std::string& statsHelp);
  /// Turns the words into values. Throws OptionError.
  void interpret();
  /// Can the files be written? Throws OptionError and OutputError, before anything is loaded.
  void check() const;

  std::string pattern;     // of the EXR files
  std::string stats;       // empty: none
  std::string framesText;  // as typed
  bool png = false, quiet = false;

  // Valid after `interpret`.
  StepRange frames;  // all by default
  ExrOptions exr;

 private:
  std::string compression_;
  bool half_ = false, full_ = false;
};

}  // namespace kairos
