// The options of `kairos render` that define the picture: view, transfer function, sampling.
#pragma once

#include <optional>
#include <string>

#include "core/transfer_function.h"
#include "raycast/render_settings.h"

namespace CLI {
class App;
}

namespace kairos {

class ViewArguments {
 public:
  /// Adds the options. `this` must outlive the parsing.
  void addTo(CLI::App& command);

  /// Turns the words into values; reads the transfer function's file. Throws OptionError and InputError for
  /// everything that is wrong whatever the volume.
  void interpret();

  /// Does the picture depend on the range of the data? Finding it may take a pass over all steps.
  bool needsDataRange() const { return stretchToData_; }

  /// The settings for a volume whose values span `dataRange`. Call after `interpret`; throws OptionError.
  RenderSettings settings(const Lattice& lattice, ValueRange dataRange) const;

 private:
  // As typed; empty where not given.
  struct Words {
    std::string view, eye, target, up, fov, ortho, size;
    std::string transferFunction, range, unitDistance;
    std::string precision, step, error, filter, mode, terminate, clipBox;
  };

  void addViewOptions(CLI::App& command);
  void addTransferOptions(CLI::App& command);
  void addSamplingOptions(CLI::App& command);
  void interpretView();
  void interpretTransferFunction();
  void interpretSampling();
  Camera camera(const Lattice& lattice) const;

  Words words_;
  RenderSettings base_;  // all that does not depend on the volume
  std::optional<Vec3d> eye_, target_, up_;
  double fov_ = 30;
  bool orthographic_ = false;
  std::optional<double> orthoHeight_;  // absent: fitted
  std::optional<ValueRange> range_;    // absent: the data's, or the transfer function's own
  bool stretchToData_ = false;
};

}  // namespace kairos
