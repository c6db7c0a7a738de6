// Influence numbers of a step's pixels, and which of these a method cast.
#pragma once

#include "app/bench_records.h"
#include "core/image.h"
#include "core/parallel.h"
#include "diff/voxel_projection.h"
#include "volume/changed_voxels.h"

namespace kairos {

/// The two histograms of a step: all pixels by their influence number, and those where `sampled` (one
/// channel, how many sampled voxels influence a pixel) is above 0. The other entries are left alone.
BenchHistogram influenceHistograms(const VoxelProjection& projection, ThreadPool& pool,
                                   const ChangedVoxels& changes, const Image& sampled);

}  // namespace kairos
