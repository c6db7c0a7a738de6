// All options of `kairos render`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/input_arguments.h"
#include "app/output_arguments.h"
#include "app/published_method_arguments.h"
#include "app/view_arguments.h"
#include "diff/frame_renderer.h"

namespace CLI {
class App;
}

namespace kairos {

class RenderArguments {
 public:
  /// Adds INPUT and all options. `this` must outlive the parsing.
  void addTo(CLI::App& command);
  /// Turns the words into values. Throws OptionError and InputError for what is wrong whatever the input.
  void interpret();

  InputArguments input;
  ViewArguments view;
  OutputArguments output;

  // Valid after `interpret`.
  double tolerance = 0;
  RendererOptions renderer;
  Isa isa = Isa::automatic;
  bool depth = false;  // --aov depth
  std::vector<FrameRenderer::Aov> aovs;
  std::string budgetText;  // as typed
  bool verify = false;     // --verify
  bool resume = false;

 private:
  struct Words {
    std::string tolerance, method, seed, threads, isa, cacheMemory;
    std::string aov;
  };

  void addMethodOptions(CLI::App& command);
  void addOutputOptions(CLI::App& command);
  void interpretMethod();
  void interpretBudget();
  void interpretAovs();

  PublishedMethodArguments published_;
  Words words_;
};

}  // namespace kairos
