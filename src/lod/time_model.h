// How long a subvolume takes to render (Li and Shen 2002, 4.2).
#pragma once

#include <cstdint>
#include <span>

namespace kairos {

/// The work one level of detail of a subvolume means.
struct LodWork {
  double slices = 0;
  double fragments = 0;  // slices times their area on the image, pixels
  double voxels = 0;     // of its texture
  bool resident = false;
};

/// What rendering a subvolume took.
struct LodTiming {
  LodWork work;
  double loadSeconds = 0;
  double geometrySeconds = 0;   // computing and submitting the slices
  double rasterizeSeconds = 0;  // from then until they were blended
  double processingSeconds() const { return geometrySeconds + rasterizeSeconds; }
};

/// T = t_load + max(t_geometry, t_rasterize) * n_slices, t_load = t_voxel * n_voxel * (1 - R).
struct PipelinedTimeModel {
  double perVoxel = 0, geometryPerSlice = 0, rasterizePerSlice = 0;
  double predict(const LodWork& work) const;
};

/// T = t_load + t_processing * n_slices: whether geometry or rasterisation limits is left open.
struct SliceTimeModel {
  double perVoxel = 0, perSlice = 0;
  double predict(const LodWork& work) const;
};

/// T = t_load + t_fragment * n_fragments: slices count by their size on the image, which the mean per slice
/// only does justice to where subvolumes are of equal size.
struct FragmentTimeModel {
  double perVoxel = 0, perFragment = 0;
  double predict(const LodWork& work) const;
};

/// t_load of all three.
double loadSeconds(double perVoxel, const LodWork& work);

/// Total time over total work, as the renderer's running means are formed. Models of no work predict 0.
PipelinedTimeModel fitPipelinedModel(std::span<const LodTiming> timings);
SliceTimeModel fitSliceModel(std::span<const LodTiming> timings);
FragmentTimeModel fitFragmentModel(std::span<const LodTiming> timings);

/// Mean of |predicted - measured| over the mean measured time.
template <class Model>
double relativeError(const Model& model, std::span<const LodTiming> timings) {
  double error = 0, total = 0;
  for (const LodTiming& t : timings) {
    const double measured = t.loadSeconds + t.processingSeconds(), d = model.predict(t.work) - measured;
    error += d < 0 ? -d : d;
    total += measured;
  }
  return total > 0 ? error / total : 0;
}

}  // namespace kairos
