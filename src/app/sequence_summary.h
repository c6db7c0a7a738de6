// Figures of a whole sequence, for the reports of `kairos diff` and `kairos info`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/sequence.h"

namespace kairos {

/// Bytes that the differential files of Shen and Johnson (1994) take for a changed voxel: position and value.
inline constexpr double kPaperBytesPerChangedVoxel = 4;

struct SequenceSummary {
  uint64_t keyFrames = 0;
  uint64_t changedVoxels = 0;
  std::vector<double> changedShares;  // of all voxels of the domain; one per step but the first
  uint64_t bytes = 0, keyBytes = 0, differentialBytes = 0;
  uint64_t nonFiniteSteps = 0, nonFiniteMost = 0;

  double medianShare() const;
  double largestShare() const;
  /// 0 when nothing changed.
  double bytesPerChangedVoxel() const;
};
SequenceSummary summarise(const SequenceManifest& manifest);

std::string changesText(const SequenceSummary& summary);
/// "; 1.23 bytes per changed voxel (the paper: 4)", or nothing when nothing changed.
std::string bytesPerVoxelText(const SequenceSummary& summary);
std::string nonFiniteText(const SequenceSummary& summary);

}  // namespace kairos
