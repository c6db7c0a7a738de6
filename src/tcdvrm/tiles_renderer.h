// The method `tiles`: the tiles whose estimated change is worth their cost; the others stay as they were.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "diff/exact_image.h"
#include "diff/frame_renderer.h"
#include "tcdvrm/budget_meter.h"
#include "tcdvrm/error_probe.h"
#include "tcdvrm/float4.h"
#include "tcdvrm/step_levels.h"

namespace kairos {

/// The change of every brick's classified colours, sub-block by sub-block, is followed along the segments
/// that read it: to first order a pixel changes by the sum of T * dC - da * (Cfinal - Cfront), where T and
/// Cfront are what the ray has gathered in front of the segment. Tiles are cast exactly in the order of
/// (estimate^2 + variance) / cost until the budget is spent; the estimates of the others are carried over. A
/// baseline: what it leaves stale ruins the image, however well it chooses.
class TilesRenderer : public FrameRenderer {
 public:
  /// Throws OptionError where the settings are out of range, of a projection, or with depth.
  TilesRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  bool seesVolume() const override { return exact_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;
  Image aov(Aov kind) const override;

 private:
  static constexpr size_t kSubBlocks = 64, kDraws = 8;  // voxels looked at of each sub-block
  /// Classified colours of a brick as last seen, and their last change; a sub-block's mean and, of changes,
  /// the mean square.
  struct Cell {
    std::vector<float> drawn;  // RGBA by RGBA
    Float4 mean[kSubBlocks], change[kSubBlocks];
    float square[kSubBlocks];
  };

  /// Change of a tile's colour, and the variance of what is not followed.
  struct Estimate {
    Float4 change{0, 0, 0, 0};
    float variance = 0;
    float squared() const { return sum4(change * change) + variance; }
  };

  void beginFrame() override { meter_.beginFrame(); }
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;

  void look(uint32_t cell, Cell& seen) const;
  void estimate(uint32_t tile);
  std::vector<uint32_t> inOrderOfWorth();
  void castExactly(std::span<const uint32_t> tiles);
  void measureError();
  CastWork workOf(uint32_t tile) const;
  size_t unitOf(uint32_t tile) const;

  BudgetMeter meter_;
  ExactImage exact_;
  StepLevels levels_;
  ErrorProbe probe_;
  std::vector<Cell> cells_;
  std::vector<uint32_t> changedIn_;  // per cell: the frame of its last change
  std::vector<double> unitError_;    // per unit of ErrorProbe: what is expected of its stale tiles
  std::vector<Estimate> estimates_;  // per tile: since it was last cast
  std::vector<uint32_t> lastCast_;   // per tile: the frame
  uint32_t frame_ = 0;
  double samplesPerLatticeSample_ = 1, segmentsPerSample_ = 0;
};

}  // namespace kairos
