// The exact methods `full` and `segments`: an image that follows a changing volume, recasting only what the
// changes touch.
#pragma once

#include "diff/exact_image.h"
#include "diff/frame_renderer.h"

namespace kairos {

/// Every frame has the bits of a full render.
///
///     DifferentialRenderer renderer(lattice, settings, options);
///     renderer.start(firstField);                       // the whole image
///     while (auto changes = nextStep()) show(renderer.update(*changes));   // only what changed
///
/// or, without the static phase, straight from a simulation's arrays:
///
///     show(renderer.render(array, tolerance));
class DifferentialRenderer : public FrameRenderer {
 public:
  /// `options.method` is full or segments. Throws OptionError naming the setting that is out of range.
  DifferentialRenderer(const Lattice& lattice, const RenderSettings& settings,
                       const RendererOptions& options);

  bool seesVolume() const override { return exact_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;

 private:
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;
  void castTiles(const std::vector<uint32_t>& tiles);
  void complete();

  ExactImage exact_;
};

}  // namespace kairos
