// Everything that defines an image of a volume. View, transfer function and sampling stay fixed over an
// animation.
#pragma once

#include <optional>
#include <string>

#include "core/box.h"
#include "core/camera.h"
#include "core/transfer_function.h"
#include "volume/field.h"

namespace kairos {

enum class Filter { trilinear, nearest };

/// dvr: emission and absorption, classified after interpolation. mip: the largest sample of each ray,
/// classified. average: the mean of each ray's samples inside the volume ("x-ray"), classified. mip and
/// average use the transfer function's opacity as it is, without correction for a distance.
enum class RenderMode { dvr, mip, average };

/// Instruction sets a kernel can be compiled for; `automatic` takes the best one this machine has. `scalar`
/// is the readable reference in float.
enum class Isa { automatic, avx512, avx2, sse4, scalar };

/// fastest: the packet kernel wherever it fits. general: the general kernel everywhere, to compare with.
enum class Kernel { fastest, general };

/// full: every channel within 1e-5 of the double-precision reference. fast: within 3e-4, less than half a
/// step of a half float at 1; u8 and u16 samples are interpolated with weights of 15 bits.
enum class Precision { full, fast };

struct RenderSettings {
  Camera camera;
  int width = 512, height = 512;

  TransferFunction transferFunction;
  ValueRange range;         // what the classification table spans
  double unitDistance = 0;  // world units over which the transfer function's opacity is meant; 0: one voxel

  double step = 1;  // sample distance in voxels (shortest voxel edge)
  Filter filter = Filter::trilinear;
  RenderMode mode = RenderMode::dvr;
  bool shade = false;  // dvr only: central-difference gradients lit by a headlight
  bool depth = false;  // dvr only: opacity-weighted mean distance from the eye as a further channel
  float terminate =
      0.999f;  // early ray termination: rays end at this opacity (see EarlyTermination); 1: never
  std::optional<PointBox> clipBox;  // world space; nothing outside is sampled

  Isa isa = Isa::automatic;
  Kernel kernel = Kernel::fastest;
  Precision precision = Precision::full;
  bool skipInvisible = true;  // off only to prove that skipping changes nothing

  /// Throws OptionError naming the option and its range.
  void validate() const;

  /// Channels of a partial and of a tile's pixels: RGBA, with depth a fifth; one for mip and average.
  int channels() const { return mode == RenderMode::dvr ? (depth ? 5 : 4) : 1; }

  /// What a tile keeps per pixel while it is cast: the channels and, for dvr, the ray's transmittance.
  int pixelPlanes() const { return mode == RenderMode::dvr ? channels() + 1 : 1; }

  /// Distance between samples in world units.
  double worldStep(const Lattice& lattice) const { return step * lattice.worldFromIndex.voxelSize(); }
  ClassificationTable classification(const Lattice& lattice) const;

  /// Voxels from the first to the last that one sample reads along an axis: 1 nearest, 2 trilinear, 2 more
  /// shaded.
  int footprintWidth() const { return (filter == Filter::trilinear ? 2 : 1) + (shade ? 2 : 0); }
  /// The low corner of a sample's footprint is floor(position + footprintShift()), in index space.
  double footprintShift() const { return (filter == Filter::trilinear ? 0.0 : 0.5) - (shade ? 1.0 : 0.0); }
};

}  // namespace kairos
