// The shading model: a white light at the eye, on surfaces given by the field's gradient.
#pragma once

namespace kairos {

/// With g the world-space gradient, d the ray's direction and n.l = |g.d| / sqrt(|g|^2 + g0^2), a colour c of
/// opacity a becomes  c * ((1 - w) + w * ambient + diffuse * n.l) + a * specular * (n.l)^16,  w = |g|^2 /
/// (|g|^2 + g0^2). Both sides of a surface are lit. Where the field is flat (|g| << g0) there is no surface,
/// and the colour stays as it is instead of following the noise of a vanishing gradient. (Levoy 1988, with a
/// headlight.)
struct Headlight {
  static constexpr float kAmbient = 0.4f, kDiffuse = 0.6f, kSpecular = 0.15f;
  /// g0, per voxel. Gradients are in units of the classified range, so that an image does not depend on the
  /// data's units, nor their squares on what a float can hold.
  static constexpr float kFlatGradient = 1.0f / 256;
  /// Data far outside the classified range may be steeper by any factor; no component counts for more.
  static constexpr float kSteepest = 1e18f;
};

}  // namespace kairos
