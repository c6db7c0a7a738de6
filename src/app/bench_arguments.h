// All options of `kairos bench`.
#pragma once

#include <string>
#include <vector>

#include "app/bench_sweep.h"
#include "app/input_arguments.h"
#include "app/option_values.h"
#include "app/view_arguments.h"

namespace CLI {
class App;
}

namespace kairos {

class BenchArguments {
 public:
  /// Adds INPUT and all options. `this` must outlive the parsing.
  void addTo(CLI::App& command);
  /// Turns the words into values. Throws OptionError and InputError for what is wrong whatever the input.
  void interpret();

  InputArguments input;
  ViewArguments view;

  // Valid after `interpret`.
  std::string output;  // directory
  StepRange frames;    // all by default
  std::string framesText;
  bool methodsNamed = false;
  SweepPlan plan;        // sample distances are empty where the view's own is meant
  bool pictures = true;  // false: none; true without steps in the plan: the middle one
  bool quiet = false;

 private:
  struct Words {
    std::string methods, budgets, steps, threads, repeat, pictures, seed, cacheMemory, projection, clock;
  };

  void interpretMethods();
  void interpretSweep();

  Words words_;
};

}  // namespace kairos
