// The dynamic phase: an image that follows a changing volume, recasting only what the changes touch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/image.h"
#include "diff/change_detection.h"
#include "raycast/render_settings.h"
#include "raycast/tile_kernel.h"
#include "volume/brick_volume.h"

namespace kairos {

/// full: every ray of every frame. segments: only the segments whose bricks changed where they read them; the
/// same bits, whatever the thread count.
enum class Method { full, segments };

struct RendererOptions {
  Method method = Method::segments;
  int threads = 0;                           // 0: all
  uint64_t cacheMemory = uint64_t(2) << 30;  // bytes for cached partials; beyond it whole rays are recast

  /// Scheduling. Never changes a bit of the image.
  enum class TileOrder { morton, rows, reversed } tileOrder = TileOrder::morton;
  int tilesPerTask = 16;
};

/// What one frame took and what it left out.
struct FrameStatistics {
  double updateMs = 0;   // bricks, value ranges, visibility
  double selectMs = 0;   // finding what the changes touch
  double castMs = 0;     // integrating and compositing
  double composeMs = 0;  // assembling the image
  uint64_t voxelsChanged = 0;
  uint64_t pixelsChanged = 0;   // pixels whose colour differs from the frame before
  uint64_t pixelsRecast = 0;    // pixels recomposited
  uint64_t segmentsTotal = 0;   // of the view
  uint64_t segmentsDirty = 0;   // touched by this step's changes in a visible brick
  uint64_t segmentsRecast = 0;  // integrated
  uint64_t samples = 0;
  uint64_t gradients = 0;
  uint64_t bricksVisible = 0;
  uint64_t bricksSkipped = 0;  // invisible ones, of the whole grid
  uint64_t tilesRecast = 0;
  uint64_t tilesUncached = 0;  // of those, cast without the cache
  uint64_t cacheBytes = 0;
};

/// Keeps a volume, its view and the image of it. View, transfer function and sampling are fixed for its
/// lifetime.
///
///     DifferentialRenderer renderer(lattice, settings, options);
///     renderer.start(firstField);                       // the whole image
///     while (auto changes = nextStep()) show(renderer.update(*changes));   // only what changed
///
/// or, without the static phase, straight from a simulation's arrays:
///
///     show(renderer.render(array, tolerance));
///
/// Not thread-safe; uses `options.threads` threads inside.
class DifferentialRenderer {
 public:
  /// Throws OptionError naming the setting that is out of range.
  DifferentialRenderer(const Lattice& lattice, const RenderSettings& settings,
                       const RendererOptions& options);
  ~DifferentialRenderer();
  DifferentialRenderer(DifferentialRenderer&&) noexcept;

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
  const Image& image() const;
  /// Opacity-weighted mean distance from the eye in world units, infinite where nothing is seen; only with
  /// RenderSettings::depth.
  const Image& depth() const;
  const FrameStatistics& statistics() const;

  /// Does any ray of the view meet the volume's bounds (and the clip box)? Known from the start.
  bool seesVolume() const;
  /// Checksum of the state shown, where known.
  std::optional<uint64_t> state() const;
  /// Bytes of bricks, segment lists and cache.
  uint64_t memoryBytes() const;
  const BrickVolume& volume() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> impl_;
};

}  // namespace kairos
