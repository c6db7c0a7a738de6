#include "app/sequence_summary.h"

#include <algorithm>

#include "app/text_format.h"

namespace kairos {

double SequenceSummary::medianShare() const {
  return median(changedShares);
}

double SequenceSummary::largestShare() const {
  return changedShares.empty() ? 0 : *std::max_element(changedShares.begin(), changedShares.end());
}

double SequenceSummary::bytesPerChangedVoxel() const {
  return changedVoxels == 0 ? 0 : double(differentialBytes) / double(changedVoxels);
}

SequenceSummary summarise(const SequenceManifest& manifest) {
  const double voxels = std::max(1.0, double(manifest.lattice.domain.voxelCount()));
  SequenceSummary s;
  for (const SequenceStep& step : manifest.steps) {
    s.keyFrames += step.key;
    s.keyBytes += step.keyBytes;
    s.differentialBytes += step.differentialBytes;
    s.changedVoxels += step.changedVoxels;
    if (step.differential) s.changedShares.push_back(double(step.changedVoxels) / voxels);
    s.nonFiniteSteps += step.nonFinite > 0;
    s.nonFiniteMost = std::max(s.nonFiniteMost, uint64_t(step.nonFinite));
  }
  s.bytes = s.keyBytes + s.differentialBytes;
  return s;
}

std::string changesText(const SequenceSummary& s) {
  if (s.changedShares.empty()) return "none: there is one step only";
  return groupedText(s.changedVoxels) + " changed voxels; of all voxels, per step: median " +
         percentText(s.medianShare()) + ", max " + percentText(s.largestShare());
}

std::string bytesPerVoxelText(const SequenceSummary& s) {
  if (s.changedVoxels == 0) return {};
  return formatted("; %.2f bytes per changed voxel (the paper: %.0f)", s.bytesPerChangedVoxel(),
                   kPaperBytesPerChangedVoxel);
}

std::string nonFiniteText(const SequenceSummary& s) {
  if (s.nonFiniteSteps == 0) return "none";
  return "in " + countText(s.nonFiniteSteps, "step") + ", at most " + groupedText(s.nonFiniteMost) +
         " a step";
}

}  // namespace kairos
