// The method `anytime`: as near to the exact image as each frame's budget allows.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "diff/exact_image.h"
#include "diff/frame_renderer.h"
#include "tcdvrm/adaptive_refinement.h"
#include "tcdvrm/block_visibility.h"
#include "tcdvrm/budget_meter.h"

namespace kairos {

/// A frame whose changes can be rendered exactly within the budget is rendered exactly. Otherwise what
/// changed is refined adaptively (AdaptiveRefinement), and its tiles are owed: whenever a later frame's
/// changes leave some of the budget, owed tiles are cast exactly, the worst first. So the image equals the
/// full render bit for bit finitely many frames after changes end. Without a budget every frame is exact.
/// Under a budget that is an error, what changed is refined until the frame is that good, and left so.
class AnytimeRenderer : public FrameRenderer {
 public:
  /// Throws OptionError where the settings are out of range, or not of a kind that can be interpolated
  /// (projections, depth).
  AnytimeRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  bool seesVolume() const override { return exact_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;
  Image aov(Aov kind) const override;

 private:
  void beginFrame() override { meter_.beginFrame(); }
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;

  size_t blockOf(uint32_t tile) const;
  CastWork exactWork(uint32_t tile) const;
  bool fits(CastWork exact);
  bool worthRefining(CastWork exact) const;
  void refineUnmarked(const BlockSet& touched);
  void refineTouched();
  void refine(const BlockSet& live, const BlockSet& uncertain);
  size_t castExactly(std::span<const uint32_t> tiles, bool whole);
  void learnSamples(double latticeSamples, double samples);
  template <class Body>
  void forTiles(size_t block, Body&& body) const;
  void restoreExact();
  void payOwed();
  void reportOwed();
  double modelledError() const;

  const bool untilGood_;  // the budget is an error
  BudgetMeter meter_;
  ExactImage exact_;
  AdaptiveRefinement refinement_;
  BlockVisibility visibility_;
  BlockSet shown_;                      // blocks that may show anything
  std::vector<uint8_t> approximated_;   // per block: refined since all of it was exact
  double samplesPerLatticeSample_ = 1;  // classified ones of the lattice samples of visible bricks
  double segmentsPerSample_ = 0;
  int exactFrames_ = 0;    // untilGood_: to come, since refinement took as much
  bool unmarked_ = false;  // changes are noted whose tiles are not known: every tile counts as owed
  ErrorEstimate lastMeasured_;
  double lastModelled_ = 0;  // what the model said of the same frame; below 0 while nobody asked
};

}  // namespace kairos
