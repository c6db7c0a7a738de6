// The second-order difference of TLDVRM: how the set of changed voxels itself changes (Liao, Lin, Chung and
// Lai 2003; Liao, Lai and Chung 2004, section 2).
#pragma once

#include <cstdint>
#include <vector>

#include "volume/changed_voxels.h"

namespace kairos {

/// The positions in exactly one of two consecutive sets of changed voxels: P(DF_t) without P(DF_t-1), and
/// P(DF_t-1) without P(DF_t). Those in both need no projection: I_t = I_t-1 - removed + added. Leaves are
/// sorted; `first` counts the voxels before a leaf within its own list.
struct SecondOrderDifference {
  std::vector<ChangedLeaf> added, removed;

  /// |SOD|: the voxels to be projected.
  uint64_t count() const;
};

SecondOrderDifference secondOrderDifference(const std::vector<ChangedLeaf>& before,
                                            const std::vector<ChangedLeaf>& now);

}  // namespace kairos
