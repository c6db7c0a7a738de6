// The published differential methods `dvrm` and `tldvrm`: rays of changed pixels, whole.
#pragma once

#include <span>
#include <vector>

#include "diff/frame_renderer.h"
#include "diff/influence_map.h"
#include "diff/pixel_recast.h"
#include "diff/time_model.h"

namespace kairos {

/// DVRM (Shen and Johnson 1994; Liao, Lai and Chung 2004, section 2): all changed voxels are projected, and
/// the rays of the pixels they influence are cast. TLDVRM (Liao, Lin, Chung and Lai 2003): the same pixels,
/// but only the voxels of the second-order difference are projected.
///
/// With the conservative projection every frame has the bits of a full render. With the paper's, pixels that
/// J leaves out keep an earlier colour; packets are cast where one of their pixels is changed, and only
/// changed pixels are written.
class DvrmRenderer : public FrameRenderer {
 public:
  /// `options.method` is dvrm or tldvrm. Throws OptionError naming the setting that is out of range.
  DvrmRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  /// I(r, s) of every pixel in the last step, row by row; see influenceHistogram.
  std::span<const int32_t> influence() const { return influence_.numbers(); }
  const TimeModel& timeModel() const { return model_; }

  Image aov(Aov kind) const override;
  bool seesVolume() const override { return recast_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;

 private:
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;
  void projectChanges(const ChangedVoxels& changes);
  void castTiles(const std::vector<uint32_t>& tiles, std::span<const int32_t> only, double updateMs);

  InfluenceMap influence_;
  std::vector<ChangedLeaf> before_;  // tldvrm: the voxels `influence_` stands for
  PixelRecast recast_;
  TimeModel model_;
};

}  // namespace kairos
