// Everything that defines an image of a volume. View, transfer function and sampling stay fixed over an
// animation.
#pragma once

#include <cmath>
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
  /// dvr, trilinear, unshaded: each ray is cut into slabs from brick face to brick face, about `step` long.
  /// Values are taken at a slab's ends, vary linearly between them, and the transfer function's integrals say
  /// what the slab emits and absorbs, its attenuation within included.
  bool preintegrated = false;
  /// Above 0: pre-integrated, and every brick picks its own slab length such that the image's
  /// root-mean-square error against a converged one is expected to stay below this; `step` is then what
  /// lengths are powers of two of.
  double error = 0;
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

  bool slabs() const { return preintegrated || error > 0; }
  /// Slabs are cut from a finer lattice, whose points lie 2^level times closer than `step`: at most an eighth
  /// of a voxel, with `error` a 32nd.
  int slabLevel() const;
  /// Distance between points of the sample lattice in voxels: `step`, or that of the slabs' lattice.
  double latticeStep() const { return slabs() ? std::ldexp(step, -slabLevel()) : step; }
  /// The same in world units.
  double worldStep(const Lattice& lattice) const {
    return latticeStep() * lattice.worldFromIndex.voxelSize();
  }
  ClassificationTable classification(const Lattice& lattice) const;

  /// Voxels from the first to the last that one sample reads along an axis: 1 nearest, 2 trilinear, 2 more
  /// shaded. Of slabs: what the two ends of one of their lattice's intervals can read.
  int footprintWidth() const {
    return (filter == Filter::trilinear ? 2 : 1) + (shade ? 2 : 0) + (slabs() ? 1 : 0);
  }
  /// The same from position to position, without whole voxels' rounding.
  double footprintExtent() const {
    return (filter == Filter::trilinear ? 2 : 1) + (shade ? 2 : 0) + (slabs() ? latticeStep() : 0);
  }
  /// The low corner of a sample's footprint is floor(position + footprintShift()), in index space.
  double footprintShift() const {
    return (filter == Filter::trilinear ? 0.0 : 0.5) - (shade ? 1.0 : 0.0) -
           (slabs() ? latticeStep() / 2 : 0);
  }
};

}  // namespace kairos
