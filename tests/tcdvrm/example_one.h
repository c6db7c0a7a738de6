// Example 1 of Liao, Lai and Chung 2004: 161 changed voxels, of which 100, 50, 10 and 1 influence one pixel
// each.
#pragma once

#include <array>

#include "diff/voxel_projection.h"
#include "support/changes.h"
#include "support/scenes.h"

namespace kairos::test {

inline constexpr std::array<int, 4> kExampleInfluence{100, 50, 10, 1};
inline constexpr int kExampleWidth = 10;

inline Lattice exampleLattice() {
  return denseLattice(ElementType::u8, {20, 20, 120});
}

/// Looks along -z; a pixel is two voxels wide and the interpolation spaces of one column of voxels fill it.
inline RenderSettings exampleView() {
  RenderSettings settings;
  settings.camera.projection = Camera::Projection::orthographic;
  settings.camera.eye = {10, 10, 200};
  settings.camera.target = {10, 10, 0};
  settings.camera.imageHeight = 20;
  settings.width = settings.height = kExampleWidth;
  return settings;
}

inline VoxelProjection exampleProjection() {
  return {exampleView(), exampleLattice(), {ProjectionOrder::trilinear, ProjectionMode::paper}};
}

inline ChangedVoxels exampleChanges() {
  VoxelMap voxels;
  for (int pixel = 0; pixel < 4; ++pixel)
    for (int z = 0; z < kExampleInfluence[size_t(pixel)]; ++z) voxels[{3 + 4 * pixel, 9, z}] = 100;
  return changesOf(ElementType::u8, voxels);
}

/// Place of the pixel (row by row) that the example's r1 to r4 stand for.
inline size_t examplePixel(int r) {
  return size_t(5 * kExampleWidth + 1 + 2 * r);
}

}  // namespace kairos::test
