// The 256^3 volumes and the view that the benchmarks share; the same family as the scenes of bench/peers.
#pragma once

#include <cstdint>
#include <vector>

#include "diff/frame_renderer.h"
#include "raycast/render_settings.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos::bench {

inline constexpr int kEdge = 256;

/// A dense 256^3 lattice with unit voxels.
Lattice lattice(ElementType type);

/// Four octaves of smooth noise in every voxel, 0 to 255.
const std::vector<uint8_t>& noise();
/// A bent, noisy column; about 5 % of the voxels are not zero.
const std::vector<uint8_t>& plume();
/// Its bends moved on by an angle: a plume that sways.
std::vector<uint8_t> plumeAt(float sway);

/// Thin matter everywhere, nowhere empty and nowhere dense: there is nothing to skip and no ray ends early.
const std::vector<uint8_t>& fog();

/// The values as a field of any element type (u16: times 257, f32: as they are).
Field fieldOf(const std::vector<uint8_t>& values, ElementType type);

/// Voxels of a ball of `fraction` of the volume around `centre` move by +-`amount`: what a local event
/// changes.
ChangedVoxels ballOfChange(const Field& field, const Vec3d& centre, double fraction, int amount);
/// One voxel of every 4^3 moves: every brick is touched.
ChangedVoxels scatteredChange(const Field& field, int amount);

/// 512x512 perspective (eye 128,-500,300, field of view 28 degrees), step 1, a smooth translucent transfer
/// function.
RenderSettings settings(ElementType type);
/// The same, thin enough for rays to pass through, and no value of fog() invisible.
RenderSettings fogSettings(ElementType type);
/// The same with opaque surfaces.
RenderSettings opaqueSettings(ElementType type);

RendererOptions rendererOptions(Method method, int threads = 1);

}  // namespace kairos::bench
