#include "raycast/render_settings.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace kairos {
namespace {

void checkNumber(const char* option, double value, double lo, double hi) {
  if (!(value >= lo && value <= hi))
    throw OptionError(option, "found " + std::to_string(value) + ", expected a number in [" +
                                  std::to_string(lo) + ", " + std::to_string(hi) + "]");
}

}  // namespace

void RenderSettings::validate() const {
  constexpr int kMaxEdge = 32768;
  if (width < 1 || height < 1 || width > kMaxEdge || height > kMaxEdge)
    throw OptionError("--size", "found " + std::to_string(width) + "x" + std::to_string(height) +
                                    ", expected a width and a height from 1 to " + std::to_string(kMaxEdge));
  checkNumber("--step", step, 1.0 / 64, 64);
  checkNumber("--terminate", terminate, 0.001, 1);
  if (unitDistance != 0 && !(unitDistance > 0 && std::isfinite(unitDistance)))
    throw OptionError("--unit-distance", "expected a length above 0 in world units");
  if (shade && mode != RenderMode::dvr)
    throw OptionError("--shade", "needs --mode dvr: a projection has no surface to light");
  if (depth && mode != RenderMode::dvr) throw OptionError("--aov", "depth needs --mode dvr");
  if (preintegrated && (mode != RenderMode::dvr || filter != Filter::trilinear || shade || depth))
    throw OptionError("--preintegrated", "needs --mode dvr and --filter trilinear, without --shade or depth");
  if (error != 0) {
    checkNumber("--error", error, 1e-6, 0.5);
    if (mode != RenderMode::dvr || filter != Filter::trilinear || shade || depth)
      throw OptionError("--error", "needs --mode dvr and --filter trilinear, without --shade or depth");
  }
  if (clipBox)
    for (int a = 0; a < 3; ++a)
      if (!(clipBox->lo[a] < clipBox->hi[a]))
        throw OptionError("--clip-box",
                          "expected X0,Y0,Z0,X1,Y1,Z1 in world units, each low end below its high end");
  if (transferFunction.colourPoints().empty()) throw OptionError("--tf", "no transfer function was given");
  camera.validate();
}

ClassificationTable RenderSettings::classification(const Lattice& lattice) const {
  const double unit = unitDistance > 0 ? unitDistance : lattice.worldFromIndex.voxelSize();
  const double distance = mode == RenderMode::dvr ? worldStep(lattice) / unit : 1.0;
  return ClassificationTable(
      transferFunction, range, distance,
      slabs() ? ClassificationTable::Content::densities : ClassificationTable::Content::opacities);
}

int RenderSettings::slabLevel() const {
  // Only bricks that choose for themselves can want slabs shorter than `step`.
  const double finest = error > 0 ? 1.0 / 32 : 1.0 / 8;
  return std::max(0, int(std::ceil(std::log2(step / finest))));
}

}  // namespace kairos
