// Options of the published methods dvrm, tldvrm and tcdvrm.
#pragma once

#include <string>

#include "diff/frame_renderer.h"

namespace CLI {
class App;
}

namespace kairos {

class PublishedMethodArguments {
 public:
  /// Adds the options to the group "Method". `this` must outlive the parsing.
  void addTo(CLI::App& command);
  /// Turns the words into values of `options`, whose method is known. Throws OptionError for what is wrong,
  /// or given to a method that knows nothing of it.
  void interpret(RendererOptions& options) const;

 private:
  std::string projection_, order_, lom_;
  bool carryOver_ = false, cutOff_ = false, noCalibration_ = false;
};

/// Does the method project changed voxels to pixels?
bool projectsVoxels(Method method);

/// What of these options decides the pixels; empty where every frame has the bits of a full render.
std::string publishedMethodText(const RendererOptions& options);

}  // namespace kairos
