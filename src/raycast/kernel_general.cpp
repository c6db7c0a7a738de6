// The general ray casting kernel: 16 rays of a tile side by side, footprints fetched by pair loads, the
// transfer function by loads of whole RGBA nodes. Compiled once per instruction set by Highway's
// foreach_target.
#include "raycast/tile_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "raycast/kernel_general.cpp"
#ifdef KAIROS_AVX2_ALONE  // sanitizers: a target takes minutes to compile
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_AVX3_DL)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
#include <hwy/foreach_target.h>
// foreach_target comes first by Highway's rules
#include <hwy/highway.h>

#include "raycast/kernel_general-inl.h"
#include "raycast/kernel_slabs-inl.h"

#if HWY_TARGET != HWY_SCALAR

HWY_BEFORE_NAMESPACE();
namespace kairos {
namespace HWY_NAMESPACE {

template <class T, Filter kFilter>
TileKernel selectMode(const KernelScene& scene) {
  switch (scene.mode) {
    case RenderMode::mip:
      return &castTile<GeneralIntegrator<T, kFilter, RenderMode::mip, false>>;
    case RenderMode::average:
      return &castTile<GeneralIntegrator<T, kFilter, RenderMode::average, false>>;
    default:
      return scene.shade || scene.depth ? &castTile<GeneralIntegrator<T, kFilter, RenderMode::dvr, true>>
                                        : &castTile<GeneralIntegrator<T, kFilter, RenderMode::dvr, false>>;
  }
}

template <class T>
TileKernel selectFilter(const KernelScene& scene) {
  if (scene.slabs) return &castTile<GeneralSlabs<T>>;
  return scene.filter == Filter::trilinear ? selectMode<T, Filter::trilinear>(scene)
                                           : selectMode<T, Filter::nearest>(scene);
}

TileKernel selectGeneral(const KernelScene& scene) {
  switch (scene.type) {
    case ElementType::u8:
      return selectFilter<uint8_t>(scene);
    case ElementType::u16:
      return selectFilter<uint16_t>(scene);
    default:
      return selectFilter<float>(scene);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kairos
HWY_AFTER_NAMESPACE();

#endif  // HWY_TARGET

#if HWY_ONCE

#include <algorithm>

#include "core/compositing.h"
#include "core/error.h"
#include "raycast/headlight.h"
#include "raycast/kernel_targets.h"

namespace kairos {
namespace {

// Best first.
constexpr KernelTarget kTargets[] = {
#if HWY_TARGETS & HWY_AVX3
    {Isa::avx512, HWY_AVX3, &N_AVX3::selectGeneral},
#endif
#if HWY_TARGETS & HWY_AVX2
    {Isa::avx2, HWY_AVX2, &N_AVX2::selectGeneral},
#endif
#if HWY_TARGETS & HWY_SSE4
    {Isa::sse4, HWY_SSE4, &N_SSE4::selectGeneral},
#endif
    {Isa::scalar, 0, nullptr},  // where no other is compiled
};

}  // namespace

const char* name(Isa isa) {
  switch (isa) {
    case Isa::avx512:
      return "avx512";
    case Isa::avx2:
      return "avx2";
    case Isa::sse4:
      return "sse4";
    case Isa::scalar:
      return "scalar";
    default:
      return "auto";
  }
}

Isa bestIsa() {
  return supportedIsas().empty() ? Isa::scalar : supportedIsas().front();
}

const std::vector<Isa>& supportedIsas() {
  static const std::vector<Isa> isas = [] {
    std::vector<Isa> list;
    for (const KernelTarget& target : kTargets)
      if (isSupported(target)) list.push_back(target.isa);
    return list;
  }();
  return isas;
}

TileKernel generalKernel(const KernelScene& scene, Isa isa) {
  if (isa == Isa::scalar || (isa == Isa::automatic && supportedIsas().empty())) return scalarKernel(scene);
  if (const KernelTarget* target = findTarget(kTargets, isa)) return target->select(scene);
  std::string known;
  for (Isa i : supportedIsas()) known += std::string(name(i)) + ", ";
  throw OptionError("--isa", std::string("this machine cannot run \"") + name(isa) + "\", expected one of " +
                                 known + "scalar");
}

TileKernel fastestKernel(const KernelScene& scene, Isa isa) {
  if (const TileKernel kernel = packetKernel(scene, isa)) return kernel;
  return generalKernel(scene, isa);
}

KernelScene makeKernelScene(const RenderSettings& settings, const BrickVolume& volume,
                            const ClassificationTable& table, const Occupancy& occupancy,
                            const SlabLevels& levels) {
  KernelScene s{};
  s.type = volume.lattice().type;
  s.bricks = volume.brickPointers().data();
  s.visible = occupancy.flags();
  s.windows = occupancy.windows();
  s.gridSize = volume.gridSize();
  s.levels = levels.levels();
  s.slabs = settings.slabs();
  s.densities = table.densities().data();
  s.integralUnit = table.integralUnit();
  s.intervals = table.intervals();
  s.rangeLo = table.range().lo;
  s.scale = table.scale();
  s.lastNode = float(table.nodeCount() - 1);
  s.firstVisible = table.firstVisible();
  s.lastVisible = table.lastVisible();
  s.filter = settings.filter;
  s.mode = settings.mode;
  s.shade = settings.shade;
  s.depth = settings.depth;
  s.fast = settings.precision == Precision::fast;
  const EarlyTermination<float> termination(settings.terminate);
  s.terminateMinimum = termination.minimum;
  s.terminateSlope = termination.slope;
  s.background = float(volume.background());
  s.worldStep = float(settings.worldStep(volume.lattice()));
  s.footprintShift = settings.footprintShift();
  const Affine indexFromWorld = volume.lattice().worldFromIndex.inverse();
  const double voxel = volume.lattice().worldFromIndex.voxelSize();
  const double rangeWidth = double(table.range().hi) - double(table.range().lo);
  const double gradientUnit = voxel / (rangeWidth > 0 ? rangeWidth : 1);
  for (int row = 0; row < 3; ++row)
    for (int a = 0; a < 3; ++a)
      s.worldFromIndexGradient[row][a] = float(indexFromWorld.column[size_t(row)][a] * gradientUnit);
  s.flatGradientSquared = Headlight::kFlatGradient * Headlight::kFlatGradient;
  return s;
}

}  // namespace kairos

#endif  // HWY_ONCE
