// Procedural volumes, transfer functions and cameras that the tests share.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/transfer_function.h"
#include "raycast/render_settings.h"
#include "volume/field.h"

namespace kairos::test {

/// One time step and the lattice all its steps share.
struct Scene {
  std::string name;
  Lattice lattice;
  Field field;
};

inline constexpr ElementType kAllTypes[] = {ElementType::u8, ElementType::u16, ElementType::f32};

/// What a scene's value 1 becomes in an element type: 255, 65535 or 1.
double fullScale(ElementType type);

/// A lattice with unit voxels and background 0 over [origin, origin + dims).
Lattice denseLattice(ElementType type, const Vec3i& dims, const Vec3i& origin = {});
Lattice sparseLattice(ElementType type, const Vec3i& dims, const Vec3i& origin = {});

/// Takes `value` (0 to 1) at every voxel of the lattice's domain, scaled to the element type and rounded for
/// integers.
Field sampledField(const Lattice& lattice, const std::function<double(const Vec3i&)>& value);

/// Reproducible noise in [0, 1): white per voxel, and smooth with features of `period` voxels.
double whiteNoise(const Vec3i& voxel, uint32_t seed);
double smoothNoise(const Vec3d& position, double period, uint32_t seed);

/// `value` everywhere inside the domain.
Scene constantScene(ElementType type, const Vec3i& dims, double value);
/// The Marschner-Lobb test signal: hard to reconstruct, no voxel at the background.
Scene marschnerLobb(ElementType type, int edge = 40);
/// A bent, noisy plume that fills a small part of the domain; sparse lattice with a negative origin. It flows
/// with `time`.
Scene plume(ElementType type, int edge = 48, double time = 0);
/// White noise from 0.1 to 0.9 in every voxel; every brick is full. Steps differ everywhere.
Scene denseNoise(ElementType type, int edge = 40, uint32_t seed = 1);
/// A few small balls far apart; most bricks hold nothing.
Scene sparseBalls(ElementType type, int edge = 64);
/// The plume of time 0 with a ball of other values, a few voxels wide, moving through it: all but the ball
/// stands still.
Scene movingBall(ElementType type, int edge = 48, double time = 0);
/// Still, smooth matter behind a front at x = 6 + 2 * time, background ahead of it: bricks appear as it
/// travels.
Scene travellingFront(ElementType type, int edge = 48, double time = 0);
/// One voxel of value 1 at (5, 6, 7); dense lattice of 16^3.
Scene singleVoxel(ElementType type);
/// Nothing but background.
Scene emptyScene(ElementType type, int edge = 32);
/// Step 0 to 99 of the bundled jet (u8, 81 x 49 x 65 voxels of edge 0.125, dense).
Scene jet1(int step);

/// All of the above (time 0, without the jet).
std::vector<Scene> allScenes(ElementType type);

/// Transfer functions over [0, fullScale(type)]: translucent ramp with its lowest values transparent; three
/// narrow bands; opaque surfaces within a voxel or two.
TransferFunction softTransferFunction(ElementType type);
TransferFunction windowedTransferFunction(ElementType type);
TransferFunction opaqueTransferFunction(ElementType type);
struct NamedTransferFunction {
  const char* name;
  TransferFunction function;
};
std::vector<NamedTransferFunction> allTransferFunctions(ElementType type);

/// A camera for the lattice by name:
///   x, -y, iso    fitted perspective
///   close         the middle third of iso (pixels finer than voxels, where the image has enough of them)
///   inside        perspective from within the volume, 70 degrees
///   ortho         oblique orthographic, fitted;  orthoClose: its middle third;  orthoZ: along -z, rays
///   parallel to bricks grazing       perspective, nearly parallel to the x faces and just beside them far
///   perspective from 300 times the volume's extent wide          130 degrees from just outside: neighbouring
///   rays are many voxels apart
Camera cameraNamed(const std::string& name, const Lattice& lattice);
const std::vector<std::string>& cameraNames();

/// Settings that render a scene: the given camera and transfer function, everything else at its default.
RenderSettings settingsFor(const Scene& scene, const std::string& camera, const TransferFunction& tf,
                           int width = 40, int height = 36);

}  // namespace kairos::test
