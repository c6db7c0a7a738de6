// The static phase's comparison: what changed between two time steps.
#pragma once

#include "core/parallel.h"
#include "volume/changed_voxels.h"

namespace kairos {

/// Compares each step with the *reconstructed* one before it and hands out the changed voxels (Shen and
/// Johnson 1994). With tolerance 0 a voxel has changed when its bits differ (a NaN equals the same NaN). With
/// a tolerance E > 0 it has changed when |new - reconstructed| > E, or when its bits differ and either is not
/// finite; since the comparison is with what a reader will have rebuilt, the error stays <= E at every step
/// of any chain (closed loop).
class ChangeDetector {
 public:
  enum class States { checksummed, unnamed };

  /// Throws OptionError("--tolerance") for a negative or non-finite tolerance. Changes that never leave the
  /// program can do without checksums of the states they lead from and to, which take a third of the
  /// comparison's time.
  ChangeDetector(Field first, double tolerance, States states = States::checksummed);

  /// Resumes with a known reconstruction; the same as the constructor, in the words of the caller.
  const Field& reconstruction() const { return reconstruction_; }
  /// 0 where states are unnamed.
  uint64_t state() const { return state_; }

  /// The changes that lead from `reconstruction()` to `next` (within the tolerance); they become part of the
  /// reconstruction. stateBefore and stateAfter are set if states are checksummed. Throws StateError when
  /// type or background differ.
  ChangedVoxels advance(Field next, ThreadPool& pool);

 private:
  Field reconstruction_;
  double tolerance_;
  States states_;
  uint64_t state_ = 0;
};

}  // namespace kairos
