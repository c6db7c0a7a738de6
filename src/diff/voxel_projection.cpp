#include "diff/voxel_projection.h"

#include <array>
#include <cmath>
#include <limits>

#include "core/camera.h"

namespace kairos {
namespace {

// Half the edge of the cube around a voxel, in voxels, whose projection is J.
double reachOf(const RenderSettings& settings, const ProjectionRules& rules, double roundingMargin) {
  const double published = rules.order == ProjectionOrder::zero ? 0.0 : 1.0;
  if (rules.mode == ProjectionMode::paper) return published;
  const double filter = settings.filter == Filter::trilinear ? 1.0 : 0.5;
  return std::max(published, filter + (settings.shade ? 1.0 : 0.0)) + roundingMargin;
}

double sumOfAbsolute(const Vec3d& v) {
  return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

// Corner c of a cube: bit a says on which side of axis a.
Vec3d cornerOffset(int c, double half) {
  return {c & 1 ? half : -half, c & 2 ? half : -half, c & 4 ? half : -half};
}

// The twelve edges of a cube as pairs of corners: four along each axis.
struct Edge {
  int axis, from, to;
};
constexpr std::array<Edge, 12> kEdges{{{0, 0, 1},
                                       {0, 2, 3},
                                       {0, 4, 5},
                                       {0, 6, 7},
                                       {1, 0, 2},
                                       {1, 1, 3},
                                       {1, 4, 6},
                                       {1, 5, 7},
                                       {2, 0, 4},
                                       {2, 1, 5},
                                       {2, 2, 6},
                                       {2, 3, 7}}};

}  // namespace

// Collects the outline of a convex polygon, edge by edge in any order, as the rows' leftmost and rightmost
// crossings. Edges inside the polygon do no harm.
class VoxelProjection::Outline {
 public:
  Outline(PixelRows& rows, const PixelRectangle& bounds) : rows_(rows) {
    rows.top = bounds.y0;
    rows.bottom = bounds.empty() ? bounds.y0 - 1 : bounds.y1;
    for (int y = rows.top; y <= rows.bottom; ++y) {
      rows.left[size_t(y)] = std::numeric_limits<double>::infinity();
      rows.right[size_t(y)] = -std::numeric_limits<double>::infinity();
    }
  }

  void add(Point a, Point b) {
    if (a.y > b.y) std::swap(a, b);
    const int last = std::min(floorWithin(b.y - 0.5, rows_.bottom + 1), rows_.bottom);
    int y = std::max(ceilWithin(a.y - 0.5, rows_.bottom + 1), rows_.top);
    if (y > last || a.y == b.y) return;
    const double slope = (b.x - a.x) / (b.y - a.y);
    for (; y <= last; ++y) {
      const double x = a.x + (y + 0.5 - a.y) * slope;
      rows_.left[size_t(y)] = std::min(rows_.left[size_t(y)], x);
      rows_.right[size_t(y)] = std::max(rows_.right[size_t(y)], x);
    }
  }

  // The pixels whose centres lie inside.
  void close(int width) {
    for (int y = rows_.top; y <= rows_.bottom; ++y) {
      rows_.first[size_t(y)] = std::max(ceilWithin(rows_.left[size_t(y)] - 0.5, width), 0);
      rows_.last[size_t(y)] = std::min(floorWithin(rows_.right[size_t(y)] - 0.5, width), width - 1);
    }
  }

 private:
  PixelRows& rows_;
};

VoxelProjection::VoxelProjection(const RenderSettings& settings, const Lattice& lattice,
                                 const ProjectionRules& rules)
    : rules_(rules),
      width_(settings.width),
      height_(settings.height),
      perspective_(settings.camera.projection == Camera::Projection::perspective),
      reach_(reachOf(settings, rules, kRoundingMargin)),
      centreX_(0.5 * settings.width),
      centreY_(0.5 * settings.height) {
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  const double pixel = generator.offsetX(centreX_ + 1);
  const Affine& world = lattice.worldFromIndex;
  const Vec3d fromEye = world.translation - settings.camera.eye;
  const auto along = [&](const Vec3d& axis, double scale, Vec3d& perVoxel, double& atOrigin, double& sum) {
    perVoxel = world.transposedVector(axis) * scale;
    atOrigin = dot(axis, fromEye) * scale;
    sum = sumOfAbsolute(perVoxel);
  };
  along(generator.right(), 1 / pixel, x_, x0_, sumX_);
  along(generator.up(), -1 / pixel, y_, y0_, sumY_);
  along(generator.forward(), 1, depth_, depth0_, sumDepth_);
  near_ = perspective_ ? 1e-6 * settings.worldStep(lattice) : 0;
  const Affine index = world.inverse();
  eye_ = index.point(settings.camera.eye);
  direction_ = index.vector(generator.forward());
}

void VoxelProjection::project(const Vec3i& voxel, PixelRows& rows) const {
  if (!rectangular()) return projectCube(Vec3d(voxel), rows);
  const PixelRectangle j = rectangle(voxel);
  rows.top = j.y0;
  rows.bottom = j.empty() ? j.y0 - 1 : j.y1;
  for (int y = rows.top; y <= rows.bottom; ++y) {
    rows.first[size_t(y)] = j.x0;
    rows.last[size_t(y)] = j.x1;
  }
}

void VoxelProjection::projectCube(const Vec3d& centre, PixelRows& rows) const {
  Outline outline(rows, rectangle(centre, reach_));
  if (rows.bottom < rows.top) return;
  if (depth0_ + dot(depth_, centre) - reach_ * sumDepth_ >= near_)
    addSilhouette(centre, outline);
  else
    addClippedCube(centre, outline);
  outline.close(width_);
}

// The edges between a face turned to the eye and one turned away, of a cube wholly in front of the eye.
void VoxelProjection::addSilhouette(const Vec3d& centre, Outline& outline) const {
  std::array<Point, 8> corner;
  for (int c = 0; c < 8; ++c) {
    const Vec3d p = centre + cornerOffset(c, reach_);
    const double scale = perspective_ ? 1 / (depth0_ + dot(depth_, p)) : 1;
    corner[size_t(c)] = {centreX_ + (x0_ + dot(x_, p)) * scale, centreY_ + (y0_ + dot(y_, p)) * scale};
  }
  std::array<std::array<bool, 2>, 3> facing;  // axis, side
  for (int a = 0; a < 3; ++a) {
    facing[size_t(a)][0] = perspective_ ? eye_[a] < centre[a] - reach_ : direction_[a] > 0;
    facing[size_t(a)][1] = perspective_ ? eye_[a] > centre[a] + reach_ : direction_[a] < 0;
  }
  for (const Edge& e : kEdges) {
    const int b = e.axis == 0 ? 1 : 0, c = e.axis == 2 ? 1 : 2;  // the axes its two faces are normal to
    if (facing[size_t(b)][e.from >> b & 1] != facing[size_t(c)][e.from >> c & 1])
      outline.add(corner[size_t(e.from)], corner[size_t(e.to)]);
  }
}

// A cube that the plane of the nearest samples cuts: what of its edges lies beyond that plane, and all
// connections between the points where they cross it.
void VoxelProjection::addClippedCube(const Vec3d& centre, Outline& outline) const {
  const auto depthOf = [&](const Vec3d& p) { return depth0_ + dot(depth_, p); };
  const auto imageOf = [&](const Vec3d& p, double depth) {
    const double scale = perspective_ ? 1 / depth : 1;
    return Point{centreX_ + (x0_ + dot(x_, p)) * scale, centreY_ + (y0_ + dot(y_, p)) * scale};
  };
  std::array<Point, 12> cut;
  size_t cuts = 0;
  for (const Edge& e : kEdges) {
    Vec3d from = centre + cornerOffset(e.from, reach_), to = centre + cornerOffset(e.to, reach_);
    if (depthOf(from) < depthOf(to)) std::swap(from, to);
    const double far = depthOf(from), close = depthOf(to);
    if (far < near_) continue;
    if (close >= near_) {
      outline.add(imageOf(from, far), imageOf(to, close));
      continue;
    }
    const double t = far > near_ ? (far - near_) / (far - close) : 0;
    cut[cuts] = imageOf(from + (to - from) * t, near_);
    outline.add(imageOf(from, far), cut[cuts]);
    for (size_t i = 0; i < cuts; ++i) outline.add(cut[i], cut[cuts]);
    ++cuts;
  }
}

}  // namespace kairos
