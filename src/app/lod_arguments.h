// All options of `kairos lod`.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "app/input_arguments.h"
#include "app/output_arguments.h"
#include "app/view_arguments.h"
#include "lod/gl_context.h"
#include "lod/importance.h"
#include "lod/lod_controller.h"
#include "lod/lod_renderer.h"
#include "lod/lod_settings.h"

namespace CLI {
class App;
}

namespace kairos {

enum class LodMethod { fragments, slices, feedback, tolerance, none };

class LodArguments {
 public:
  /// Adds INPUT and all options. `this` must outlive the parsing.
  void addTo(CLI::App& command);
  /// Turns the words into values. Throws OptionError and InputError for what is wrong whatever the input.
  void interpret();

  /// The volume's settings; throws OptionError for what this renderer does not do.
  LodSettings settings(const RenderSettings& picture, const Lattice& lattice) const;
  Importance importance(const RenderSettings& picture) const;
  /// `profile`: what was measured; zeros where nothing was.
  std::unique_ptr<LodController> controller(const RenderSettings& picture, const LodProfile& profile) const;

  InputArguments input;
  ViewArguments view;
  OutputArguments output;

  // Valid after `interpret`.
  LodMethod method = LodMethod::none;
  double budgetSeconds = 0;  // 0: none
  GlPlatform platform = GlPlatform::automatic;
  int threads = 0;

  const char* methodName() const;

 private:
  struct Words {
    std::string controller, budget, importance, gaze, tolerance, coherence;
    std::string textureMemory, slices, blend, subvolumeMemory, subvolumeDeviation, platform, threads;
  };

  void addTimeOptions(CLI::App& command);
  void addVolumeOptions(CLI::App& command);
  void interpretTime();
  void interpretVolume();

  Words words_;
  std::optional<Vec3d> gaze_;  // x, y in pixels
  std::vector<std::pair<std::string, double>> importances_;
  double tolerance_ = 0.01, coherence_ = 0;
  LodSettings base_;
};

}  // namespace kairos
