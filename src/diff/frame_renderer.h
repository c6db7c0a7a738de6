// What every method of rendering a changing volume offers: the dynamic phase, frame by frame.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/budget.h"
#include "core/image.h"
#include "core/parallel.h"
#include "diff/change_detection.h"
#include "diff/voxel_projection.h"
#include "raycast/scene_state.h"

namespace kairos {

/// Exact, the same bits whatever the thread count:
///   full      every ray of every frame
///   segments  only the segments whose bricks changed where they read them
///   dvrm      the rays of changed pixels (Liao, Lai and Chung 2004)
///   tldvrm    the same, influence numbers kept up to date through the second-order difference
/// As near to exact as a budget allows:
///   anytime   exact where that fits, else adaptive refinement of the new image
///   tcdvrm    the rays that most sampled voxels influence (Liao, Lai and Chung 2004)
///   tiles     the tiles with the largest estimated change for their cost; the others stay as they were
///   lowres    a coarser image, enlarged
enum class Method { full, segments, dvrm, tldvrm, anytime, tcdvrm, tiles, lowres };
const char* name(Method method);
/// Does the method take a budget?
bool budgeted(Method method);
/// Of this kind?
bool takes(Method method, const Budget& budget);

/// The level of modification that tcdvrm spends its budget by: how many changed voxels influence a pixel, or
/// by how much their values have grown or shrunk.
enum class LevelOfModification { influence, magnitude };

struct TcdvrmOptions {
  LevelOfModification lom = LevelOfModification::influence;
  bool calibrate = true;   // measure the cost of a sampling point in every step; else in the first alone
  bool carryOver = false;  // changed voxels stay candidates until all pixels they influence are cast
  /// End casting when the time is over, the least influenced rays uncast. The paper trusts its prediction.
  bool cutOff = false;
};

struct RendererOptions {
  Method method = Method::segments;
  int threads = 0;                           // 0: all
  uint64_t cacheMemory = uint64_t(2) << 30;  // bytes for cached partials; beyond it whole rays are recast

  Budget budget;                 // of every frame but the first; budgeted methods only
  uint64_t seed = 0;             // of whatever is drawn at random
  BudgetClock* clock = nullptr;  // null: steadyBudgetClock(); must outlive the renderer

  bool blend =
      true;  // anytime: what lies between rays has the previous image's detail, as far as it persists
  ProjectionRules projection;  // dvrm, tldvrm, tcdvrm: which pixels a changed voxel influences
  TcdvrmOptions tcdvrm;

  /// Scheduling. Never changes a bit of the image.
  enum class TileOrder { morton, rows, reversed } tileOrder = TileOrder::morton;
  int tilesPerTask = 16;
};

struct ErrorEstimate {
  double rmse = 0, low = 0, high = 0;
};

/// What one frame took and what it left out.
struct FrameStatistics {
  double updateMs = 0;   // bricks, value ranges, visibility
  double selectMs = 0;   // finding what to cast
  double castMs = 0;     // integrating and compositing
  double composeMs = 0;  // assembling the image
  uint64_t voxelsChanged = 0;
  uint64_t voxelsSampled = 0;     // of those, looked at one by one or through their bricks
  uint64_t pixelsChanged = 0;     // pixels whose colour differs from the frame before
  uint64_t pixelsInfluenced = 0;  // changed pixels in the sense of dvrm (I > 0), tldvrm and tcdvrm (D > 0)
  uint64_t rayPoints = 0;         // TS: sampling points along the rays chosen by dvrm, tldvrm and tcdvrm
  uint64_t pixelsRecast = 0;      // pixels recomposited
  uint64_t segmentsTotal = 0;     // of the view
  uint64_t segmentsDirty = 0;     // touched by this step's changes in a visible brick
  uint64_t segmentsRecast = 0;    // integrated
  uint64_t samples = 0;
  uint64_t gradients = 0;
  uint64_t bricksVisible = 0;
  uint64_t bricksSkipped = 0;  // invisible ones, of the whole grid
  uint64_t tilesRecast = 0;
  uint64_t tilesUncached = 0;  // of those, cast without the cache
  uint64_t cacheBytes = 0;

  // Under a budget.
  uint64_t raysCast = 0;
  uint64_t stalePixels = 0;           // pixels that still show an earlier step
  int stepLevel = 1;                  // sample distance of the rays, in units of the exact frame's
  std::optional<double> predictedMs;  // by equations 1 and 4 before casting; dvrm, tldvrm, tcdvrm
  bool budgetTooSmall = false;  // for the coarsest image of the method: part of it shows an earlier step
  /// How far the image is from the exact one: an estimate of the RMSE over all pixels and channels with its
  /// 95 % confidence interval. 0 where it is known to be exact; empty where nothing is known.
  std::optional<ErrorEstimate> error;
};

/// Keeps a volume, its view and the image of it. View, transfer function and sampling are fixed for its
/// lifetime. Not thread-safe; uses `options.threads` threads inside.
class FrameRenderer {
 public:
  virtual ~FrameRenderer();
  FrameRenderer(const FrameRenderer&) = delete;
  FrameRenderer& operator=(const FrameRenderer&) = delete;

  /// Takes the first (or any) whole step and renders it in full. Throws StateError when it does not fit the
  /// lattice.
  const Image& start(const Field& field);

  /// Applies one step's changes and brings the image up to date. Throws StateError when they belong to
  /// another state than the volume's (or before `start`), or touch voxels outside the domain; volume and
  /// image are then unchanged.
  const Image& update(const ChangedVoxels& changes);

  /// The same two from a dense array of the lattice's domain, x fastest: compares it with what is shown,
  /// within `tolerance` (see ChangeDetector), and updates. Throws StateError when T is not the lattice's
  /// type.
  template <class T>
  const Image& render(const T* values, double tolerance = 0);

  /// Premultiplied linear RGBA, top row first.
  const Image& image() const { return image_; }
  /// Opacity-weighted mean distance from the eye in world units, infinite where nothing is seen; only with
  /// RenderSettings::depth.
  const Image& depth() const { return depth_; }
  const FrameStatistics& statistics() const { return statistics_; }

  /// Per pixel, one channel: `error`, the RMSE over a pixel's channels that is expected; `age`, steps since
  /// the pixel was last cast; `level`, the stride in pixels of the rays it was interpolated from, 1 where it
  /// was cast; `influence`, how many changed voxels influence it (dvrm, tldvrm; tcdvrm: of those sampled);
  /// `samples`, sampling points along its ray, in bricks that are visible. An exact image's are 0, 0 and 1;
  /// what a method does not know is 0.
  enum class Aov { error, age, level, influence, samples };
  static const char* name(Aov kind);
  virtual Image aov(Aov kind) const;

  /// Does any ray of the view meet the volume's bounds (and the clip box)? Known from the start.
  virtual bool seesVolume() const = 0;
  /// Checksum of the state shown, where known.
  std::optional<uint64_t> state() const { return scene_.checksum(); }
  /// Bytes of bricks, segment lists and caches.
  virtual uint64_t memoryBytes() const = 0;
  const BrickVolume& volume() const { return scene_.volume(); }

 protected:
  /// Throws OptionError naming the setting that is out of range.
  FrameRenderer(const Lattice& lattice, const RenderSettings& settings, const RendererOptions& options);

  /// Called first, before a step is taken in.
  virtual void beginFrame() {}
  /// Called with a step's changes while the scene still holds the values that they replace.
  virtual void beforeUpdate(const ChangedVoxels& /*changes*/) {}
  /// Renders the whole step that the scene holds now.
  virtual void renderWhole() = 0;
  /// Brings the image up to date; the scene holds the new step. Both set what they know of `statistics_`,
  /// which the caller has cleared but for the update's own.
  virtual void renderChanges(const ChangedVoxels& changes, const AppliedChanges& applied) = 0;

  const RendererOptions options_;
  ThreadPool pool_;
  SceneState scene_;
  Image image_, depth_;
  FrameStatistics statistics_;

 private:
  void takeWhole(const Field& field);
  void takeChanges(const ChangedVoxels& changes);
  void countBricks();

  // Follows the arrays shown; none after a field or changes from elsewhere.
  std::unique_ptr<ChangeDetector> detector_;
  double detectorTolerance_ = 0;
};

}  // namespace kairos
