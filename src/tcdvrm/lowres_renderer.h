// The method `lowres`: a coarser image of the new step, enlarged.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "diff/exact_image.h"
#include "diff/frame_renderer.h"
#include "tcdvrm/block_visibility.h"
#include "tcdvrm/budget_meter.h"
#include "tcdvrm/error_probe.h"
#include "tcdvrm/step_levels.h"

namespace kairos {

/// Casts a uniform lattice of rays, as dense as the budget allows, at the sample distance that promises the
/// least error, and enlarges it by bicubic interpolation (Catmull-Rom; Keys 1981). Nothing is reused from
/// earlier frames: the baseline that any method under a budget has to beat. The first frame is exact.
class LowresRenderer : public FrameRenderer {
 public:
  /// `stepLevel` fixes the sample distance to 2^stepLevel times the exact frame's. Throws OptionError where
  /// the settings are out of range, or of a kind that cannot be interpolated (projections, depth).
  LowresRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options,
                 std::optional<int> stepLevel = std::nullopt);

  bool seesVolume() const override { return exact_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;
  Image aov(Aov kind) const override;

 private:
  /// A choice of sample distance and of the rays' stride, 2^(eighths / 8) pixels.
  struct Choice {
    int stepLevel = 0, eighths = 0;
    double stride() const;
    auto operator<=>(const Choice&) const = default;
  };

  void beginFrame() override { meter_.beginFrame(); }
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;

  CastWork workOf(const Choice& choice) const;
  void learnInterpolation();
  bool choose(double budget);
  double expectedError(const Choice& choice) const;
  BlockSet visibleBlocks() const;
  std::vector<uint32_t> visibleUnits() const;
  const TileCaster& casterOf(const Choice& choice);
  void castCoarse();
  struct PixelBox {
    int left, top, right, bottom;
  };
  PixelBox shownBox();
  void enlarge();
  void measureError();

  std::optional<int> fixedLevel_;
  BudgetMeter meter_;
  ExactImage exact_;
  StepLevels levels_;
  ErrorProbe probe_;
  std::map<Choice, std::unique_ptr<TileCaster>> casters_;
  Choice choice_;
  CastWork fullWork_;         // of one ray per pixel at the exact sample distance
  double lateral_ = 0;        // squared error of the last frame's interpolation, per pixel
  double lateralStride_ = 1;  // and its stride
  double firstLateral_ = 0;   // of the first frame, at a stride of 4
  double finishMs_ = 0;
  bool frameExact_ = true;
  std::optional<BlockVisibility> visibility_;  // where segments are listed
  BlockSet shown_;                             // blocks that may show anything
  Image coarse_, wide_;
};

}  // namespace kairos
