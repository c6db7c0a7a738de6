// By how much changed voxels grow or shrink.
#pragma once

#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "volume/brick_volume.h"
#include "volume/changed_voxels.h"

namespace kairos {

/// |new value - old value| of every changed voxel, in the order of `changes`; `volume` still holds the old
/// values. NaN and infinities count as the background that they are rendered as; voxels outside the volume's
/// domain count as unchanged.
std::vector<float> changeMagnitudes(const BrickVolume& volume, const ChangedVoxels& changes,
                                    ThreadPool& pool);

/// Weights from 1 to 65535 in proportion to the magnitudes, for WeightedSampler.
std::vector<uint16_t> samplingWeights(const std::vector<float>& magnitudes);

}  // namespace kairos
