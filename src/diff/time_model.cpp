#include "diff/time_model.h"

namespace kairos {
namespace {

uint64_t sectors(uint64_t bytes) {
  return (bytes + TimeModel::kSectorBytes - 1) / TimeModel::kSectorBytes;
}

}  // namespace

void TimeModel::measure(double& constant, double took, uint64_t units) const {
  if (units > 0 && took > 0 && (calibrate_ || constant == 0)) constant = took / double(units);
}

void TimeModel::observe(const StepWork& work, const StepTimes& took) {
  measure(constants_.sector, took.read, sectors(work.bytesRead));
  measure(constants_.voxel, took.update, work.voxels);
  measure(constants_.projected, took.select, work.projected);
  measure(constants_.rayPoint, took.cast, work.rayPoints);
}

double TimeModel::predict(const StepWork& work) const {
  return double(sectors(work.bytesRead)) * constants_.sector + double(work.voxels) * constants_.voxel +
         double(work.projected) * constants_.projected + double(work.rayPoints) * constants_.rayPoint;
}

}  // namespace kairos
