// Cameras and primary rays.
#pragma once

#include <string>

#include "core/box.h"
#include "core/vec3.h"

namespace kairos {

/// A primary ray in world space. `direction` has unit length, so t is a world distance from `origin`.
struct Ray {
  Vec3d origin, direction;
};

/// Perspective (vertical field of view) or orthographic (image height in world units). World space is
/// right-handed; row 0 of the image is its top. An orthographic ray starts on the plane through `eye`:
/// nothing behind it is seen.
struct Camera {
  enum class Projection { perspective, orthographic };

  Vec3d eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  Projection projection = Projection::perspective;
  double verticalFovDegrees = 30;  // perspective, in (0, 180)
  double imageHeight = 1;          // orthographic, world units

  bool operator==(const Camera&) const = default;

  /// Throws OptionError when eye and target coincide, `up` is parallel to the view, or the field of view or
  /// the image height is out of range.
  void validate() const;
};

/// Maps pixels of a width x height image to rays; immutable, safe to share between threads.
class RayGenerator {
 public:
  RayGenerator(const Camera& camera, int width, int height);

  /// The ray through image position (x, y) in pixels; pixel (i, j) has its centre at (i + 0.5, j + 0.5).
  Ray ray(double x, double y) const;

  /// Orthonormal image axes in world space; `up` points towards row 0.
  Vec3d right() const { return right_; }
  Vec3d up() const { return up_; }
  Vec3d forward() const { return forward_; }
  /// Offset of image position x (or y) from the image's centre, along right (or against up): on the plane at
  /// distance 1 (perspective) or in world units (orthographic).
  double offsetX(double x) const { return (x - centreX_) * pixel_; }
  double offsetY(double y) const { return (y - centreY_) * pixel_; }

 private:
  Vec3d eye_, right_, up_, forward_;
  bool perspective_;
  double
      pixel_;  // edge of a pixel: on the plane at distance 1 (perspective) or in world units (orthographic)
  double centreX_, centreY_;
};

/// A perspective camera that sees the whole of `worldBox` from the direction named by `view`: "x" looks from
/// the +x side towards the box, "-x" from the -x side, likewise y and z; "iso" looks from the direction (1,
/// -1.5, 0.8); z is up (y for the z views). Throws OptionError for another name.
Camera fittedCamera(const std::string& view, const PointBox& worldBox, double verticalFovDegrees,
                    double aspect);

/// The same view with an orthographic projection.
Camera fittedOrthographicCamera(const std::string& view, const PointBox& worldBox, double aspect);

}  // namespace kairos
