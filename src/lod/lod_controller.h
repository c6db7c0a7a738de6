// Choosing each subvolume's level of detail while a frame is rendered: against the clock, and the methods
// that this is compared with.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lod/time_model.h"

namespace kairos {

/// A subvolume about to be rendered.
struct LodTask {
  uint32_t subvolume = 0;
  double importance = 1;
  std::vector<LodWork> work;       // per level of detail, finest first
  std::vector<double> deviations;  // per level of detail: what is lost, see LodVolume::deviation
};

/// The frame as it begins: all subvolumes that will be rendered, in order.
struct LodFramePlan {
  double budget = 0;  // seconds for all subvolumes; 0: none was set
  std::vector<uint32_t> subvolumes;
  std::vector<double> importances;
};

/// Makes the decisions of one renderer, frame after frame.
class LodController {
 public:
  virtual ~LodController() = default;
  virtual void beginFrame(const LodFramePlan& plan) = 0;
  /// The level of detail for the next subvolume; `elapsed` seconds of the frame are spent.
  virtual int choose(const LodTask& task, double elapsed) = 0;
  /// What the chosen level took.
  virtual void rendered(const LodTask& task, int lod, const LodTiming& timing) = 0;
  /// The frame as a whole; `elapsed` as in `choose`.
  virtual void endFrame(double elapsed) = 0;
  /// Can not even the coarsest levels be rendered within the budget? As of the last `endFrame`.
  virtual bool infeasible() const { return false; }
  /// Time for `subvolume` that the last choice was made for, in seconds; 0 where the method has no such
  /// thing.
  virtual double lastShare() const { return 0; }
};

/// Every subvolume at its finest level.
std::unique_ptr<LodController> makeFinestController();

/// Each subvolume at the coarsest level that loses no more than `tolerance` (Laur and Hanrahan 1991).
std::unique_ptr<LodController> makeToleranceController(double tolerance);

/// The tolerance is adjusted from frame to frame by fuzzy logic on the last frame's time and its change
/// (Li and Shen 2001). Starts at `tolerance`, above 0.
std::unique_ptr<LodController> makeFeedbackController(double tolerance);

/// What the predictive controllers can be told.
struct PredictiveOptions {
  /// fragments: time goes with the fragments drawn. slices: with the number of slices, the paper's
  /// simplification.
  enum class Unit { fragments, slices } unit = Unit::fragments;
  /// A subvolume keeps its level while its share of the importance has changed by less than this fraction
  /// since it was chosen, unless the level has become wrong by more than one step. 0: never.
  double coherence = 0;
  // First guesses, from profiling, for the first subvolumes of the first frame.
  double secondsPerVoxel = 0;  // to load
  double secondsPerUnit = 0;
};

/// Li and Shen 2002, 4: before each subvolume the time left is divided among those to come by importance, and
/// the level is taken whose predicted time is closest to its share. Loading time per voxel and processing
/// time per unit are means over the subvolumes of this frame; the first one goes by the last frame's.
std::unique_ptr<LodController> makePredictiveController(const PredictiveOptions& options);

}  // namespace kairos
