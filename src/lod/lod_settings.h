// What the LOD renderer shows and how it may divide the volume.
#pragma once

#include "core/camera.h"
#include "core/transfer_function.h"
#include "lod/subdivision.h"
#include "volume/field.h"

namespace kairos {

/// dvr: emission and absorption. mip: the largest sample of each ray, classified.
enum class LodMode { dvr, mip };

/// How slices lie in perspective. planes: perpendicular to the view; a sample's opacity is corrected for the
/// distance between planes along its own ray. shells: spheres about the eye, the samples of the ray caster.
/// With an orthographic camera both are the same.
enum class SliceShape { planes, shells };

enum class BlendOrder { frontToBack, backToFront };

struct LodSettings {
  int width = 512, height = 512;

  TransferFunction transferFunction;
  ValueRange range;         // what the classification table spans
  double unitDistance = 0;  // world units over which the transfer function's opacity is meant; 0: one voxel

  /// Distance between slices of the finest level in voxels. Slice k of a level lies at (k + 0.5) times its
  /// distance from the eye, whatever the subvolume: one lattice, the ray caster's.
  double step = 1;
  LodMode mode = LodMode::dvr;
  SliceShape shape = SliceShape::planes;
  BlendOrder order = BlendOrder::frontToBack;

  SubdivisionOptions subdivision;  // bytesPerTexel is filled in by the renderer
  uint64_t textureMemory = uint64_t(256) << 20;
  /// Levels of detail per halving of resolution: with 2, the slices of every second one are sqrt(2) further
  /// apart on the same texture. A finer ladder meets a time budget more closely.
  int lodsPerLevel = 2;

  /// Throws OptionError naming the option and its range.
  void validate() const;

  double worldStep(const Lattice& lattice) const { return step * lattice.worldFromIndex.voxelSize(); }
  /// Slice distance of a level of detail, in units of the finest.
  double spacing(int lod) const;
  int levelOf(int lod) const { return lod / lodsPerLevel; }
  int lodCount(int levels) const { return (levels - 1) * lodsPerLevel + 1; }
  /// The table for one level of detail (opacity depends on the slice distance).
  ClassificationTable classification(const Lattice& lattice, int lod) const;
};

}  // namespace kairos
