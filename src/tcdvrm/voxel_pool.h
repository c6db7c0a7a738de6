// Changed voxels that wait to be sampled, from one step or several.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "volume/changed_voxels.h"

namespace kairos {

/// A set of changed voxels whose values are not new values but magnitudes of change (f32), so that voxels of
/// several steps can wait together. Those in both sets add up their magnitudes.
ChangedVoxels unitedVoxels(const ChangedVoxels& waiting, const std::vector<ChangedLeaf>& changed,
                           std::span<const float> magnitudes);

/// The voxels of the set for which `keep` holds.
ChangedVoxels keptVoxels(const ChangedVoxels& set, const std::function<bool(const Vec3i&)>& keep);

}  // namespace kairos
