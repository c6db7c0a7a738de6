#include "lod/time_model.h"

#include <algorithm>

namespace kairos {
namespace {

struct Sums {
  double load = 0, geometry = 0, rasterize = 0, voxels = 0, slices = 0, fragments = 0;

  explicit Sums(std::span<const LodTiming> timings) {
    for (const LodTiming& t : timings) {
      load += t.loadSeconds;
      geometry += t.geometrySeconds;
      rasterize += t.rasterizeSeconds;
      voxels += t.work.resident ? 0 : t.work.voxels;
      slices += t.work.slices;
      fragments += t.work.fragments;
    }
  }
};

double ratio(double a, double b) {
  return b > 0 ? a / b : 0;
}

}  // namespace

double loadSeconds(double perVoxel, const LodWork& work) {
  return work.resident ? 0 : perVoxel * work.voxels;
}

double PipelinedTimeModel::predict(const LodWork& work) const {
  return loadSeconds(perVoxel, work) + std::max(geometryPerSlice, rasterizePerSlice) * work.slices;
}

double SliceTimeModel::predict(const LodWork& work) const {
  return loadSeconds(perVoxel, work) + perSlice * work.slices;
}

double FragmentTimeModel::predict(const LodWork& work) const {
  return loadSeconds(perVoxel, work) + perFragment * work.fragments;
}

PipelinedTimeModel fitPipelinedModel(std::span<const LodTiming> timings) {
  const Sums s(timings);
  return {ratio(s.load, s.voxels), ratio(s.geometry, s.slices), ratio(s.rasterize, s.slices)};
}

SliceTimeModel fitSliceModel(std::span<const LodTiming> timings) {
  const Sums s(timings);
  return {ratio(s.load, s.voxels), ratio(s.geometry + s.rasterize, s.slices)};
}

FragmentTimeModel fitFragmentModel(std::span<const LodTiming> timings) {
  const Sums s(timings);
  return {ratio(s.load, s.voxels), ratio(s.geometry + s.rasterize, s.fragments)};
}

}  // namespace kairos
