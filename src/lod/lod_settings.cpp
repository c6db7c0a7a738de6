#include "lod/lod_settings.h"

#include <cmath>
#include <string>

#include "core/error.h"

namespace kairos {

void LodSettings::validate() const {
  constexpr int kMaxEdge = 32768;
  if (width < 1 || height < 1 || width > kMaxEdge || height > kMaxEdge)
    throw OptionError("--size", "found " + std::to_string(width) + "x" + std::to_string(height) +
                                    ", expected a width and a height from 1 to " + std::to_string(kMaxEdge));
  if (!(step >= 1.0 / 64 && step <= 64)) throw OptionError("--step", "expected voxels from 1/64 to 64");
  if (unitDistance != 0 && !(unitDistance > 0 && std::isfinite(unitDistance)))
    throw OptionError("--unit-distance", "expected a length above 0 in world units");
  if (transferFunction.colourPoints().empty()) throw OptionError("--tf", "no transfer function was given");
  if (lodsPerLevel != 1 && lodsPerLevel != 2)
    throw OptionError("levels of detail", "expected 1 or 2 per halving of resolution");
  subdivision.validate();
}

double LodSettings::spacing(int lod) const {
  return std::exp2(double(lod) / lodsPerLevel);
}

ClassificationTable LodSettings::classification(const Lattice& lattice, int lod) const {
  const double unit = unitDistance > 0 ? unitDistance : lattice.worldFromIndex.voxelSize();
  const double distance = mode == LodMode::dvr ? worldStep(lattice) * spacing(lod) / unit : 1.0;
  return ClassificationTable(transferFunction, range, distance);
}

}  // namespace kairos
