// Which pixels a changed voxel influences: the set J(x, y, z) of Liao, Lai and Chung 2004, definition 1.
#pragma once

#include <algorithm>
#include <vector>

#include "raycast/render_settings.h"
#include "volume/field.h"

namespace kairos {

/// zero: the pixels around the projected point (discrete rays, zero-order interpolation). trilinear: the
/// pixels inside the projected interpolation space, the voxels' distance to each side (continuous rays,
/// trilinear interpolation).
enum class ProjectionOrder { zero, trilinear };

/// paper: J as published, whatever the renderer samples. conservative: everything of that, and every pixel
/// whose colour the voxel can alter: its projected footprint under the view's filter, gradient stencil
/// included, enclosed in a rectangle.
enum class ProjectionMode { paper, conservative };

struct ProjectionRules {
  ProjectionOrder order = ProjectionOrder::trilinear;
  ProjectionMode mode = ProjectionMode::conservative;
  bool operator==(const ProjectionRules&) const = default;
};

/// Columns x0 to x1 of rows y0 to y1, all included, inside the image.
struct PixelRectangle {
  int x0 = 0, y0 = 0, x1 = -1, y1 = -1;
  bool operator==(const PixelRectangle&) const = default;
  bool empty() const { return x1 < x0 || y1 < y0; }
};

/// A convex set of pixels: columns first[y] to last[y] of each row y from `top` to `bottom`; a row with
/// last < first has none. Made once for an image and filled again and again.
struct PixelRows {
  explicit PixelRows(int imageHeight)
      : first(size_t(imageHeight)),
        last(size_t(imageHeight)),
        left(size_t(imageHeight)),
        right(size_t(imageHeight)) {}
  int top = 0, bottom = -1;
  std::vector<int> first, last;
  std::vector<double> left, right;  // scratch of VoxelProjection::project
};

/// Projects voxels of one lattice to the pixels of one view. Immutable, safe to share between threads;
/// allocates nothing per voxel.
class VoxelProjection {
 public:
  /// Throws OptionError when the settings' camera or size is out of range.
  VoxelProjection(const RenderSettings& settings, const Lattice& lattice, const ProjectionRules& rules);

  int width() const { return width_; }
  int height() const { return height_; }
  const ProjectionRules& rules() const { return rules_; }

  /// Is J a rectangle for every voxel? Only the paper's trilinear J is not.
  bool rectangular() const {
    return rules_.order == ProjectionOrder::zero || rules_.mode == ProjectionMode::conservative;
  }

  /// J where `rectangular()`, otherwise a rectangle around it. Voxels are in index space.
  PixelRectangle rectangle(const Vec3i& voxel) const { return rectangle(Vec3d(voxel), reach_); }

  /// A rectangle around J of every voxel in the cube of `edge`^3 voxels from `first`.
  PixelRectangle rectangleOfCube(const Vec3i& first, int edge) const {
    const double half = 0.5 * (edge - 1);
    return rectangle(Vec3d(first) + Vec3d{half, half, half}, reach_ + half + kRoundingMargin);
  }

  /// J, row by row.
  void project(const Vec3i& voxel, PixelRows& rows) const;

 private:
  struct Point {
    double x, y;
  };
  class Outline;

  // The kernels' positions are floats; see touchedSubBlocks.
  static constexpr double kRoundingMargin = 1e-3;

  PixelRectangle rectangle(const Vec3d& centre, double half) const;
  void projectCube(const Vec3d& centre, PixelRows& rows) const;
  void addSilhouette(const Vec3d& centre, Outline& outline) const;
  void addClippedCube(const Vec3d& centre, Outline& outline) const;

  // Largest integer <= x and smallest >= x, for x clamped to [-2, limit].
  static int floorWithin(double x, int limit) { return int(std::clamp(x, -2.0, double(limit)) + 2) - 2; }
  static int ceilWithin(double x, int limit) {
    const double clamped = std::clamp(x, -2.0, double(limit));
    const int below = int(clamped + 2) - 2;
    return below + (double(below) < clamped);
  }

  ProjectionRules rules_;
  int width_, height_;
  bool perspective_;
  double reach_;  // half the edge of the cube whose projection is J
  // Image position of an index-space point p, in pixels: centre + (x, y), divided by the depth in
  // perspective; x = x0 + dot(x_, p), and likewise y (downwards) and the depth in world units.
  double x0_, y0_, depth0_, centreX_, centreY_;
  Vec3d x_, y_, depth_;
  double sumX_, sumY_, sumDepth_;  // of the absolute values of these vectors
  double near_;                    // depth below which no ray takes a sample
  Vec3d eye_, direction_;          // of the rays, in index space
};

inline PixelRectangle VoxelProjection::rectangle(const Vec3d& centre, double half) const {
  const double depth = depth0_ + dot(depth_, centre), farthest = depth + half * sumDepth_;
  if (farthest < near_) return {};
  double left = x0_ + dot(x_, centre) - half * sumX_, right = left + 2 * half * sumX_;
  double top = y0_ + dot(y_, centre) - half * sumY_, bottom = top + 2 * half * sumY_;
  if (perspective_) {
    const double least = 1 / farthest, most = 1 / std::max(depth - half * sumDepth_, near_);
    left *= left < 0 ? most : least;
    top *= top < 0 ? most : least;
    right *= right < 0 ? least : most;
    bottom *= bottom < 0 ? least : most;
  }
  // Pixel i has its centre at i + 0.5.
  left += centreX_ - 0.5;
  right += centreX_ - 0.5;
  top += centreY_ - 0.5;
  bottom += centreY_ - 0.5;
  if (rules_.order == ProjectionOrder::zero)  // the pixels around; inside in the other case
    return {std::max(floorWithin(left, width_), 0), std::max(floorWithin(top, height_), 0),
            std::min(floorWithin(right, width_) + 1, width_ - 1),
            std::min(floorWithin(bottom, height_) + 1, height_ - 1)};
  return {std::max(ceilWithin(left, width_), 0), std::max(ceilWithin(top, height_), 0),
          std::min(floorWithin(right, width_), width_ - 1),
          std::min(floorWithin(bottom, height_), height_ - 1)};
}

}  // namespace kairos
