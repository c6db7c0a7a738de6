// The polygons that a subvolume is rendered with.
#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "lod/lod_settings.h"
#include "lod/subdivision.h"

namespace kairos {

/// A vertex of a slice as the vertex shader takes it: its place in clip space, and of its slice the point
/// straight ahead (relative to SliceView::anchor) and the factor for image offsets (see slice.frag).
struct SliceVertex {
  float x, y;
  float base[3], scale;
};

/// Slices of one subvolume, one triangle fan each, in blending order.
struct SlicePolygons {
  std::vector<SliceVertex> vertices;
  std::vector<int32_t> first, count;
  double pixels = 0;  // their area on the image

  int slices() const { return int(first.size()); }
  void clear();
};

/// One camera looking at the cells of a subdivision.
class SliceView {
 public:
  /// `origin` is the voxel index of the subdivision's vertex (0, 0, 0), `cells` its size.
  SliceView(const Camera& camera, const LodSettings& settings, const Lattice& lattice, const Vec3i& origin,
            const Vec3i& cells);

  bool parallel() const { return parallel_; }
  /// The eye (perspective) or the viewing direction (orthographic) in the subdivision's coordinates.
  Vec3d orderingEye() const;
  /// The middle of the volume: shaders compute relative to it, so that distances to the eye cost no
  /// precision.
  const Vec3d& anchor() const { return anchor_; }
  /// Image axes in index space, one world unit long.
  const Vec3d& right() const { return right_; }
  const Vec3d& down() const { return down_; }
  const Vec3d& forward() const { return forward_; }
  double pixel() const { return pixel_; }

  /// A box of cells as the image sees it.
  struct Box {
    std::array<Vec3d, 8> corners;  // camera coordinates in world units: right, down, forward
    double nearest, farthest;      // of its slices: depth, or distance for shells
    double cosineLo, cosineHi;     // of the angle between its rays and the view; 1 but for shells
  };
  /// Grown by half a pixel, so that no sample inside is lost to rounding.
  Box box(const VoxelBox& cells) const;

  /// Slices per unit of inverse distance, and fragments likewise: n slices of distance d make about
  /// depth / d of one and volume / d of the other.
  struct Extent {
    double depth = 0;                 // world units
    double volume = 0;                // pixels * world units, on the image
    double area = 0;                  // pixels: the box's silhouette on the image
    double centreX = 0, centreY = 0;  // pixels
    double distance = 0;              // world units from the eye to its centre
  };
  Extent extent(const Box& box) const;

  /// All slices with this distance between them, in world units.
  void slice(const Box& box, double spacing, SlicePolygons& polygons) const;

 private:
  struct Point {
    double x, y;
  };
  using Polygon = std::vector<Point>;  // pixels

  Point project(const Vec3d& p) const;
  void section(const Box& box, double z0, double z1) const;  // into polygon_
  double clippedArea() const;
  void appendSlice(const Vec3d& base, double scale, SlicePolygons& polygons) const;

  bool parallel_, shells_, reversed_;
  int width_, height_;
  double pixel_;
  Affine cameraFromCells_;  // x right, y down, z forward
  Vec3d anchor_, eye_;      // eye relative to the anchor, index space
  Vec3d right_, down_, forward_;
  double screenCosine_;
  Vec3d growth_;                                // cells per pixel of unit size
  mutable Polygon points_, polygon_, clipped_;  // scratch
};

}  // namespace kairos
