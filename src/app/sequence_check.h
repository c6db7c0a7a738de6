// Re-reading a whole sequence: is every file intact, and does the chain rebuild every step?
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/progress.h"
#include "io/sequence.h"

namespace kairos {

struct SequenceCheck {
  std::vector<std::string> problems;  // one line each; empty: sound
  size_t stepsRebuilt = 0;
};

/// Reads every file of the sequence, verifies its checksums, applies the differential files one after the
/// other and compares each rebuilt state with the manifest. Behind a damaged file the chain goes on at the
/// next key frame. Throws Interrupted.
SequenceCheck checkSequence(const SequenceReader& reader, const StopFlag& stop,
                            const ProgressCallback& progress);

}  // namespace kairos
