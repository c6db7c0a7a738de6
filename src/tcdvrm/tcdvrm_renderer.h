// The published time-critical method `tcdvrm` (Liao, Lai and Chung 2004, section 3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "diff/frame_renderer.h"
#include "diff/pixel_recast.h"
#include "diff/time_model.h"
#include "tcdvrm/pixel_selection.h"
#include "tcdvrm/voxel_sampler.h"

namespace kairos {

/// Changed voxels are drawn at random, without replacement, until casting the rays of the pixels that they
/// influence is predicted to use up the budget; these rays are cast, those of the most sampled pixels first.
/// Pixels that no sampled voxel influences keep an earlier colour. Following the algorithm's lines 5 to 19:
///
///   T_elp    time since the step was handed over, read after every sample
///   TS       sampling points along the rays chosen, in bricks that are visible (see PixelRecast::rayPoints)
///   T        T_elp + TS * C_c; sampling ends at T >= TB, or at TS >= the budget's samples, or when all
///   changed
///            voxels are sampled
///   C_c      from step 0 and, unless switched off, measured anew in every step
///
/// Rays are cast in packets of 4x4, so TS counts packets, and with the conservative projection all pixels of
/// a packet are written; with the paper's only those that a sampled voxel influences. With a budget of
/// samples two runs of the same seed have the same bits at any number of threads; without a limit every frame
/// has those of `dvrm`.
class TcdvrmRenderer : public FrameRenderer {
 public:
  /// Throws OptionError naming the setting that is out of range.
  TcdvrmRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  /// D(r, s) of every pixel in the last step, row by row; see influenceHistogram.
  std::span<const int32_t> sampledInfluence() const { return selection_.counts(); }
  const TimeModel& timeModel() const { return model_; }

  /// `samples` is the paper's S(r, s), `influence` D(r, s).
  Image aov(Aov kind) const override;
  bool seesVolume() const override { return recast_.caster().seesVolume(); }
  uint64_t memoryBytes() const override;

 private:
  void beginFrame() override;
  void beforeUpdate(const ChangedVoxels& changes) override;
  void renderWhole() override;
  void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) override;

  double elapsed() const { return clock_.now() - begin_; }
  const ChangedVoxels& candidates(const ChangedVoxels& changes);
  bool select(const ChangedVoxels& candidates);
  template <class Sampler>
  bool drawUntilBudgetIsUsed(const ChangedVoxels& candidates, Sampler& sampler);
  bool budgetIsUsed() const;
  bool castSelected();
  void keepWaiting();
  void cast(std::span<const uint32_t> tiles);
  uint64_t rayPointsCast();
  void learn(double updateMs, uint64_t rayPoints);

  BudgetClock& clock_;
  VoxelProjection projection_;
  PixelSelection selection_;
  UniformSampler uniform_;
  WeightedSampler weighted_;
  PixelRecast recast_;
  TimeModel model_;
  uint64_t frame_ = 0;  // steps since the first; each draws with a seed of its own
  double begin_ = 0;    // of the frame, on the clock
  bool exact_ = false;  // no pixel was left out since the first step
  std::vector<float> magnitudes_;
  ChangedVoxels waiting_;  // with carry-over: candidates; after a step, those that wait for the next
  std::span<const uint32_t> uncast_;  // selected tiles that the end of the time left out
};

}  // namespace kairos
