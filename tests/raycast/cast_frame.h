// Casting whole images with a kernel, without the differential renderer.
#pragma once

#include <memory>
#include <vector>

#include "raycast/occupancy.h"
#include "raycast/reference_caster.h"
#include "raycast/tile_kernel.h"
#include "support/scenes.h"

namespace kairos::test {

/// Row-major, `channels` floats a pixel, as castReference lays them out.
struct CastFrame {
  int channels = 0;
  std::vector<float> pixels;
  TileCounters counters;

  const float* pixel(size_t i) const { return pixels.data() + i * size_t(channels); }
};

struct NamedKernel {
  const char* name;
  TileKernel cast;
};

/// A scene under one set of settings, ready to be cast by any kernel. Not movable: the kernel scene points
/// into it.
class Caster {
 public:
  Caster(const Scene& scene, const RenderSettings& settings);
  Caster(const Caster&) = delete;
  Caster& operator=(const Caster&) = delete;

  /// Every kernel this machine has for the scene: the packet kernel, all instruction sets of the general one,
  /// scalar.
  std::vector<NamedKernel> kernels() const;
  CastFrame cast(const NamedKernel& kernel) const;
  /// With the fastest kernel.
  CastFrame cast() const { return cast({"fastest", fastestKernel(kernelScene_, Isa::automatic)}); }
  std::vector<double> reference() const { return castReference(settings_, *volume_); }

  const RenderSettings& settings() const { return settings_; }
  const BrickVolume& volume() const { return *volume_; }
  const ViewRays& view() const { return *view_; }
  const ClassificationTable& table() const { return table_; }
  const Occupancy& occupancy() const { return *occupancy_; }
  const KernelScene& kernelScene() const { return kernelScene_; }
  /// Samples of every pixel's ray inside the volume.
  std::vector<int> sampleCounts() const;
  /// Copies a tile's planes into the frame.
  void place(int tile, const float* tilePixels, CastFrame& frame) const;
  CastFrame emptyFrame() const;

 private:
  RenderSettings settings_;
  ThreadPool pool_{1};
  ClassificationTable table_;
  std::unique_ptr<BrickVolume> volume_;
  std::unique_ptr<ViewRays> view_;
  std::unique_ptr<Occupancy> occupancy_;
  std::unique_ptr<SlabLevels> levels_;
  KernelScene kernelScene_;
};

/// The largest difference between a frame and the reference, each channel scaled so that 1e-5 means the same:
/// colour and alpha as they are, depth relative to twice the distance, projections relative to the type's
/// full scale (average: per sample). `pixelsBeyond` counts the pixels that differ by more than 1e-5.
struct Deviation {
  double largest = 0;
  int pixelsBeyond = 0;
};
Deviation deviation(const Caster& caster, const CastFrame& frame, const std::vector<double>& reference);

/// An oracle of its own, straight from the field: no bricks, no segments, no termination. One pixel's values
/// in the layout of castReference; dvr without shading and depth, mip, average.
std::vector<double> castFieldDirectly(const Scene& scene, const RenderSettings& settings);

}  // namespace kairos::test
