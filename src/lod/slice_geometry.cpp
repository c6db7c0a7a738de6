#include "lod/slice_geometry.h"

#include <algorithm>
#include <cmath>

namespace kairos {
namespace {

constexpr int kEdges[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                               {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

template <class Point>
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Andrew's monotone chain.
template <class Polygon>
void convexHull(Polygon& points, Polygon& hull) {
  hull.clear();
  if (points.size() < 3) return;
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  for (int side = 0; side < 2; ++side) {
    const size_t start = hull.size();
    for (const auto& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  if (hull.size() < 3) hull.clear();
}

template <class Polygon>
double area(const Polygon& polygon) {
  double twice = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return std::abs(twice) / 2;
}

// Keeps the part of a convex polygon where inside(p) >= 0 (Sutherland and Hodgman 1974).
template <class Polygon, class Inside>
void clip(Polygon& polygon, Polygon& scratch, Inside&& inside) {
  scratch.clear();
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = inside(a), db = inside(b);
    if (da >= 0) scratch.push_back(a);
    if ((da >= 0) == (db >= 0)) continue;
    const double f = da / (da - db);
    scratch.push_back({a.x + f * (b.x - a.x), a.y + f * (b.y - a.y)});
  }
  std::swap(polygon, scratch);
}

}  // namespace

void SlicePolygons::clear() {
  vertices.clear();
  first.clear();
  count.clear();
  pixels = 0;
}

SliceView::SliceView(const Camera& camera, const LodSettings& settings, const Lattice& lattice,
                     const Vec3i& origin, const Vec3i& cells)
    : parallel_(camera.projection == Camera::Projection::orthographic),
      shells_(settings.shape == SliceShape::shells && !parallel_),
      reversed_(settings.order == BlendOrder::backToFront),
      width_(settings.width),
      height_(settings.height) {
  const RayGenerator rays(camera, width_, height_);
  pixel_ = rays.offsetX(1) - rays.offsetX(0);
  const Affine fromWorld = lattice.worldFromIndex.inverse();
  anchor_ = Vec3d(cells) * 0.5;
  eye_ = fromWorld.point(camera.eye) - Vec3d(origin) - anchor_;
  right_ = fromWorld.vector(rays.right());
  down_ = -fromWorld.vector(rays.up());
  forward_ = fromWorld.vector(rays.forward());
  const Vec3d axes[] = {rays.right(), -rays.up(), rays.forward()};
  for (int a = 0; a < 3; ++a) {
    const Vec3d& column = lattice.worldFromIndex.column[size_t(a)];
    cameraFromCells_.column[size_t(a)] = {dot(axes[0], column), dot(axes[1], column), dot(axes[2], column)};
    growth_[a] = 0.5 * pixel_ / length(column);
  }
  cameraFromCells_.translation = -cameraFromCells_.vector(eye_ + anchor_);
  const double x = rays.offsetX(width_), y = rays.offsetY(height_);
  screenCosine_ = 1 / std::sqrt(1 + x * x + y * y);
}

Vec3d SliceView::orderingEye() const {
  return parallel_ ? forward_ : eye_ + anchor_;
}

SliceView::Point SliceView::project(const Vec3d& p) const {
  const double scale = 1 / (parallel_ ? pixel_ : pixel_ * p.z);
  return {0.5 * width_ + p.x * scale, 0.5 * height_ + p.y * scale};
}

SliceView::Box SliceView::box(const VoxelBox& cells) const {
  Box box;
  Vec3d grown{};
  for (int pass = 0; pass < 2; ++pass) {
    double farthest = 0;
    box.nearest = 1e300;
    for (size_t c = 0; c < 8; ++c) {
      const Vec3d p{c & 1 ? cells.hi.x + grown.x : cells.lo.x - grown.x,
                    c & 2 ? cells.hi.y + grown.y : cells.lo.y - grown.y,
                    c & 4 ? cells.hi.z + grown.z : cells.lo.z - grown.z};
      box.corners[c] = cameraFromCells_.point(p);
      box.nearest = std::min(box.nearest, box.corners[c].z);
      farthest = std::max(farthest, box.corners[c].z);
    }
    box.farthest = farthest;
    grown = growth_ * (parallel_ ? 1 : farthest);
  }
  box.cosineLo = box.cosineHi = 1;
  if (!shells_) return box;
  // A sphere of radius r meets the box's rays at depths from r * cosineLo to r * cosineHi.
  box.cosineLo = screenCosine_;
  for (const Vec3d& p : box.corners) box.farthest = std::max(box.farthest, length(p));
  if (box.nearest <= 0) return box;
  double farOut = 0, lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
  for (const Vec3d& p : box.corners) {
    const double q[] = {p.x / p.z, p.y / p.z};
    farOut = std::max(farOut, q[0] * q[0] + q[1] * q[1]);
    for (int a = 0; a < 2; ++a) {
      lo[a] = std::min(lo[a], q[a]);
      hi[a] = std::max(hi[a], q[a]);
    }
  }
  double closeIn = 0;
  for (int a = 0; a < 2; ++a) {
    const double d = std::max({0.0, lo[a], -hi[a]});
    closeIn += d * d;
  }
  box.cosineLo = std::max(screenCosine_, 1 / std::sqrt(1 + farOut));
  box.cosineHi = std::max(box.cosineLo, 1 / std::sqrt(1 + closeIn));
  box.nearest /= box.cosineHi;
  return box;
}

// The outline on the image of what the box holds between two depths.
void SliceView::section(const Box& box, double z0, double z1) const {
  points_.clear();
  for (const Vec3d& p : box.corners)
    if (p.z > z0 && p.z < z1) points_.push_back(project(p));
  for (const auto& edge : kEdges) {
    const Vec3d &a = box.corners[size_t(edge[0])], &b = box.corners[size_t(edge[1])];
    for (int end = 0; end < (z0 == z1 ? 1 : 2); ++end) {
      const double z = end ? z1 : z0;
      if ((a.z < z) == (b.z < z)) continue;
      Vec3d p = a + (b - a) * ((z - a.z) / (b.z - a.z));
      p.z = z;
      points_.push_back(project(p));
    }
  }
  convexHull(points_, polygon_);
}

double SliceView::clippedArea() const {
  clipped_ = polygon_;
  const bool inside = std::all_of(polygon_.begin(), polygon_.end(), [&](const Point& p) {
    return p.x >= 0 && p.y >= 0 && p.x <= width_ && p.y <= height_;
  });
  if (!inside) {
    clip(clipped_, points_, [](const Point& p) { return p.x; });
    clip(clipped_, points_, [](const Point& p) { return p.y; });
    clip(clipped_, points_, [this](const Point& p) { return width_ - p.x; });
    clip(clipped_, points_, [this](const Point& p) { return height_ - p.y; });
  }
  return area(clipped_);
}

SliceView::Extent SliceView::extent(const Box& box) const {
  // Gauss and Legendre's three points of [0, 1].
  constexpr double kDepths[] = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr double kWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  constexpr double kClosest = 1e-3;  // pixels in world units at depth 1: just in front of the eye
  Extent e;
  const double zNear = std::max(box.nearest * box.cosineHi, kClosest * pixel_), zFar = box.farthest;
  if (zFar <= zNear) return e;
  e.depth = box.farthest - std::max(0.0, box.nearest);
  double deepest = 0;
  for (const Vec3d& p : box.corners) deepest = std::max(deepest, p.z);
  const double thickness = deepest - zNear;
  for (int i = 0; i < 3; ++i) {
    const double z = zNear + kDepths[i] * thickness;
    section(box, z, z);
    e.volume += kWeights[i] * clippedArea() * thickness;
  }
  section(box, zNear, deepest * (1 + 1e-9));
  e.area = clippedArea();
  for (const Point& p : clipped_) {
    e.centreX += p.x / double(clipped_.size());
    e.centreY += p.y / double(clipped_.size());
  }
  Vec3d centre{};
  for (const Vec3d& p : box.corners) centre = centre + p * 0.125;
  e.distance = parallel_ ? centre.z : length(centre);
  return e;
}

void SliceView::slice(const Box& box, double spacing, SlicePolygons& polygons) const {
  polygons.clear();
  const int first = std::max(0, int(std::ceil(box.nearest / spacing - 0.5)));
  const int last = int(std::floor(box.farthest / spacing - 0.5));
  for (int i = 0; i <= last - first; ++i) {
    const double t = ((reversed_ ? last - i : first + i) + 0.5) * spacing;
    section(box, t * box.cosineLo, t * box.cosineHi);
    if (!polygon_.empty()) appendSlice(eye_ + forward_ * t, parallel_ ? 1 : t, polygons);
  }
}

void SliceView::appendSlice(const Vec3d& base, double scale, SlicePolygons& polygons) const {
  const double pixels = clippedArea();
  if (pixels <= 0) return;
  polygons.pixels += pixels;
  polygons.first.push_back(int32_t(polygons.vertices.size()));
  polygons.count.push_back(int32_t(clipped_.size()));
  for (const Point& p : clipped_)
    polygons.vertices.push_back({float(2 * p.x / width_ - 1),
                                 float(2 * p.y / height_ - 1),
                                 {float(base.x), float(base.y), float(base.z)},
                                 float(scale)});
}

}  // namespace kairos
