// The time-critical multiresolution renderer of Li and Shen 2002: subvolumes of a 3D texture, each at the
// level of detail that its share of the frame's time allows.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/parallel.h"
#include "lod/clock.h"
#include "lod/gl_context.h"
#include "lod/importance.h"
#include "lod/lod_controller.h"
#include "lod/lod_settings.h"
#include "lod/lod_volume.h"
#include "lod/slice_geometry.h"
#include "lod/slice_program.h"
#include "lod/subvolume_textures.h"

namespace kairos {

/// One subvolume of a frame, in the order of rendering.
struct SubvolumeRecord {
  uint32_t subvolume = 0;
  int lod = 0, level = 0;  // level of detail; the texture's resolution
  double importance = 0;   // as a fraction of the frame's
  double share = 0;        // seconds it was given; 0 without a budget
  SubvolumeView view;
  LodTiming timing;
};

/// What a frame took, in seconds and counts.
struct LodStatistics {
  double totalSeconds = 0;    // from the call to the image
  double controlSeconds = 0;  // deciding: visibility, importance, prediction, choice
  double loadSeconds = 0, geometrySeconds = 0, rasterizeSeconds = 0, readSeconds = 0;
  double budgetSeconds = 0;  // 0: none
  bool infeasible = false;   // not even the coarsest levels fit the budget
  uint64_t subvolumes = 0, skipped = 0;
  uint64_t slices = 0;
  double fragments = 0;
  uint64_t texturesLoaded = 0, bytesLoaded = 0, texturesKept = 0;
  uint64_t openBoundaries = 0;  // subvolumes a neighbour of which turned out coarser than was assumed
  std::vector<SubvolumeRecord> records;
};

/// What profiling found out (Li and Shen 2002, 4.2.1).
struct LodProfile {
  double secondsPerVoxel = 0, secondsPerFragment = 0, secondsPerSlice = 0;
};

/// Renders a volume through OpenGL. Used by one thread, the context's.
class LodRenderer {
 public:
  /// The context must outlive the renderer. Throws OptionError for settings out of range, or for an image or
  /// subvolumes that the context or the texture memory cannot hold; GlError.
  LodRenderer(const GlContext& context, const Lattice& lattice, const Field& field,
              const LodSettings& settings, ThreadPool& pool, const LodHierarchy* stored = nullptr);

  const LodVolume& volume() const { return volume_; }
  const LodSettings& settings() const { return settings_; }

  /// Loads textures until the texture memory is full and renders at the coarsest levels, to measure what
  /// loading and rendering cost here; also compiles what the driver compiles late.
  LodProfile profile(const Camera& camera, Clock& clock);

  /// Renders one frame. `budgetSeconds` is for all of it; 0: none. The image is valid until the next call.
  const Image& render(const Camera& camera, LodController& controller, const Importance& importance,
                      double budgetSeconds, Clock& clock);

  /// Takes over the changed voxels of the next time step. Only textures that hold some of them are loaded
  /// again, and only where they changed. Throws StateError.
  void apply(const ChangedVoxels& changes);

  const Image& image() const { return image_; }
  /// Of the last frame.
  const LodStatistics& statistics() const { return statistics_; }
  const TexturePoolCounters& textureCounters() const { return textures_.counters(); }
  uint64_t textureBytes() const { return textures_.bytes(); }

 private:
  struct Visible {
    uint32_t subvolume;
    SliceView::Box box;
    SliceView::Extent extent;
  };

  void findVisible(const SliceView& view);
  void weigh(const Importance& importance);
  const LodTask& taskOf(const Visible& visible, double importance);
  void renderSubvolume(const SliceView& view, const Visible& visible, double importance, double began,
                       LodController& controller, Clock& clock);
  double loadTextures(int coarser, Clock& clock);
  void finishImage();
  void countOpenBoundaries();
  void measureOpacities(const std::vector<uint32_t>& subvolumes);
  SliceProgram& program(bool parallel);

  const GlContext& context_;
  LodSettings settings_;
  LodVolume volume_;
  PointBox sampled_;  // cells: where samples are taken
  ClassificationTable unitTable_;
  SubvolumeTextures textures_;
  Framebuffer framebuffer_;
  std::optional<SliceProgram> perspective_, parallel_;
  std::vector<double> maxOpacity_;
  SubvolumeLevels levels_;            // of this frame, or of the last where it is yet to be rendered
  std::vector<uint64_t> signatures_;  // of the boundaries as rendered in this frame
  std::vector<uint32_t> order_;
  std::vector<Visible> visible_;
  std::vector<SubvolumeView> views_;
  std::vector<double> importances_;
  double importanceSum_ = 0, readSeconds_ = 0;
  LodTask task_;
  SlicePolygons polygons_;
  Image image_;
  LodStatistics statistics_;
};

}  // namespace kairos
