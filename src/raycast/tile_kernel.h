// What a ray casting kernel is given and what it returns: one call per tile.
#pragma once

#include <cstdint>
#include <vector>

#include "raycast/occupancy.h"
#include "raycast/render_settings.h"
#include "raycast/segment_index.h"
#include "raycast/slab_levels.h"

namespace kairos {

/// What all tiles of a frame share. Pointers stay valid during the frame.
struct KernelScene {
  ElementType type;
  const void* const* bricks;  // per cell
  const uint8_t* visible;     // per cell
  const uint64_t* windows;    // per cell: which of its windows are visible
  const uint8_t* levels;      // per cell: SlabLevels; only of slabs
  int levelBias;              // added to every level
  Vec3i gridSize;

  const ClassificationTable::DensityInterval* densities;  // entry 0 below the range
  float integralUnit;
  bool slabs;
  const ClassificationTable::Interval* intervals;
  float rangeLo, scale, lastNode;
  float firstVisible, lastVisible;

  Filter filter;
  RenderMode mode;
  bool shade, depth;
  bool fast;                               // Precision::fast
  float terminateMinimum, terminateSlope;  // EarlyTermination
  float background;
  float worldStep;
  double footprintShift;
  float worldFromIndexGradient[3][3];  // rows; from index space to ranges per voxel edge
  float flatGradientSquared;           // g0^2 of Headlight
};

KernelScene makeKernelScene(const RenderSettings& settings, const BrickVolume& volume,
                            const ClassificationTable& table, const Occupancy& occupancy,
                            const SlabLevels& levels);

/// Counts of work done, added up over tiles.
struct TileCounters {
  uint64_t samples = 0;  // classified (dvr) or accumulated (mip, average) samples
  uint64_t segmentsIntegrated = 0;
  uint64_t segmentsComposited = 0;  // reused ones included
  uint64_t segmentsSkipped = 0;     // in invisible bricks
  uint64_t gradients = 0;

  TileCounters& operator+=(const TileCounters& o) {
    samples += o.samples;
    segmentsIntegrated += o.segmentsIntegrated;
    segmentsComposited += o.segmentsComposited;
    segmentsSkipped += o.segmentsSkipped;
    gradients += o.gradients;
    return *this;
  }
};

/// A tile to cast: its rays and its segments, front to back. With `partials` (segments x channels x 16
/// floats, the first segment's first) and `stale` (a flag per segment), partials of segments that are not
/// stale are reused, and those that are and turn out to matter are integrated, kept, and marked fresh;
/// segments behind the point where all rays have terminated stay as they are. Without them everything is
/// integrated and nothing kept. `pixels` receives RenderSettings::pixelPlanes() x 16 floats.
struct TileTask {
  const TileRays* rays;
  const Segment* segments;
  uint32_t segmentCount;
  float* partials;
  uint8_t* stale;
  float* pixels;
};

/// Casts one tile. Thread-safe, allocates nothing, never throws.
using TileKernel = void (*)(const KernelScene&, const TileTask&, TileCounters&);

/// The general kernel (any view, any filter): 16 rays at once with pair loads, compiled for several
/// instruction sets through Highway. Throws OptionError("--isa") where this machine lacks the one asked for.
TileKernel generalKernel(const KernelScene& scene, Isa isa);

/// The packet kernel: a packet's neighbourhood held in registers; takes the general kernel for segments whose
/// packet is spread too wide. Null where this machine, the instruction set asked for, or the scene (element
/// type, filter, mode, shading) has none.
TileKernel packetKernel(const KernelScene& scene, Isa isa);

/// The fastest kernel for the scene: the packet kernel where there is one, else the general one.
TileKernel fastestKernel(const KernelScene& scene, Isa isa);

/// The readable scalar kernel in float, one lane after the other; what `--isa scalar` runs.
TileKernel scalarKernel(const KernelScene& scene);

/// What `Isa::automatic` stands for here: the best set both compiled and supported.
Isa bestIsa();
/// Every instruction set generalKernel accepts on this machine, best first; the scalar reference is not among
/// them.
const std::vector<Isa>& supportedIsas();
const char* name(Isa isa);

}  // namespace kairos
