#include "core/camera.h"

#include <numbers>

#include "core/error.h"

namespace kairos {

void Camera::validate() const {
  for (const Vec3d& v : {eye, target, up})
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw OptionError("camera", "eye, target and up must be finite numbers");
  if (!(length(target - eye) > 0)) throw OptionError("--eye", "eye and target are the same point");
  if (!(length(cross(normalized(target - eye), up)) > 1e-9 * length(up)))
    throw OptionError("--up", "the up vector is zero or parallel to the viewing direction");
  if (projection == Projection::perspective && !(verticalFovDegrees > 0 && verticalFovDegrees < 180))
    throw OptionError("--fov", "expected degrees in (0, 180)");
  if (projection == Projection::orthographic && !(imageHeight > 0 && std::isfinite(imageHeight)))
    throw OptionError("--ortho", "expected a height above 0 in world units");
}

RayGenerator::RayGenerator(const Camera& camera, int width, int height)
    : eye_(camera.eye), perspective_(camera.projection == Camera::Projection::perspective) {
  camera.validate();
  if (width < 1 || height < 1)
    throw OptionError("--size", "expected a width and a height of at least 1 pixel");
  forward_ = normalized(camera.target - camera.eye);
  right_ = normalized(cross(forward_, camera.up));
  up_ = cross(right_, forward_);
  const double extent =
      perspective_ ? 2 * std::tan(camera.verticalFovDegrees * std::numbers::pi / 360) : camera.imageHeight;
  pixel_ = extent / height;
  centreX_ = 0.5 * width;
  centreY_ = 0.5 * height;
}

Ray RayGenerator::ray(double x, double y) const {
  const Vec3d offset = right_ * offsetX(x) - up_ * offsetY(y);
  if (perspective_) return {eye_, normalized(forward_ + offset)};
  return {eye_ + offset, forward_};
}

namespace {

struct ViewAxes {
  Vec3d from, up;
};

ViewAxes namedView(const std::string& view) {
  if (view == "iso") return {normalized({1, -1.5, 0.8}), {0, 0, 1}};
  const bool negative = view.size() == 2 && view[0] == '-';
  const std::string axis = negative ? view.substr(1) : view;
  const double sign = negative ? -1 : 1;
  if (axis == "x") return {{sign, 0, 0}, {0, 0, 1}};
  if (axis == "y") return {{0, sign, 0}, {0, 0, 1}};
  if (axis == "z") return {{0, 0, sign}, {0, 1, 0}};
  throw OptionError("--view", "found \"" + view + "\", expected x, -x, y, -y, z, -z or iso");
}

constexpr double kMargin = 1.04;  // a little air around the box

// Calls f(right, up, towards the eye) with each corner's coordinates relative to the box centre.
template <class F>
void forEachCorner(const ViewAxes& axes, const PointBox& box, F&& f) {
  const Vec3d right = normalized(cross(-axes.from, axes.up));
  const Vec3d up = cross(right, -axes.from);
  const Vec3d half = (box.hi - box.lo) * 0.5;
  for (int c = 0; c < 8; ++c) {
    const Vec3d corner{c & 1 ? half.x : -half.x, c & 2 ? half.y : -half.y, c & 4 ? half.z : -half.z};
    f(dot(corner, right), dot(corner, up), dot(corner, axes.from));
  }
}

}  // namespace

Camera fittedCamera(const std::string& view, const PointBox& worldBox, double verticalFovDegrees,
                    double aspect) {
  const ViewAxes axes = namedView(view);
  if (!(verticalFovDegrees > 0 && verticalFovDegrees < 180))
    throw OptionError("--fov", "expected degrees in (0, 180)");
  const double tanY = std::tan(verticalFovDegrees * std::numbers::pi / 360), tanX = tanY * aspect;
  double distance = 0;
  forEachCorner(axes, worldBox, [&](double x, double y, double towardsEye) {
    distance = std::max(distance, towardsEye + kMargin * std::max(std::abs(x) / tanX, std::abs(y) / tanY));
  });
  Camera camera;
  camera.target = (worldBox.lo + worldBox.hi) * 0.5;
  camera.eye = camera.target + axes.from * (distance > 0 ? distance : 1.0);
  camera.up = axes.up;
  camera.verticalFovDegrees = verticalFovDegrees;
  return camera;
}

Camera fittedOrthographicCamera(const std::string& view, const PointBox& worldBox, double aspect) {
  const ViewAxes axes = namedView(view);
  double halfHeight = 0, depth = 0;
  forEachCorner(axes, worldBox, [&](double x, double y, double towardsEye) {
    halfHeight = std::max({halfHeight, std::abs(y), std::abs(x) / aspect});
    depth = std::max(depth, towardsEye);
  });
  Camera camera;
  camera.projection = Camera::Projection::orthographic;
  camera.target = (worldBox.lo + worldBox.hi) * 0.5;
  camera.eye = camera.target + axes.from * (depth > 0 ? 2 * depth : 1.0);
  camera.up = axes.up;
  camera.imageHeight = halfHeight > 0 ? 2 * kMargin * halfHeight : 1.0;
  return camera;
}

}  // namespace kairos
