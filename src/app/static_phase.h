// The static phase: a simulation's steps become a sequence.
#pragma once

#include <functional>
#include <string>

#include "core/parallel.h"
#include "core/progress.h"
#include "io/input_series.h"
#include "io/sequence.h"

namespace kairos {

struct StaticPhaseReports {
  ProgressCallback progress;                        // (steps finished, steps in all)
  std::function<void(const std::string&)> warning;  // one line each
};

/// Brings `writer`'s sequence, which stands in `directory`, up to the end of `input`, and finishes it. Steps
/// it already has are rebuilt from its own files; the rest are read, compared and written. The three overlap,
/// each in threads of its own with short queues between them, so that memory stays at a few fields whatever
/// the length.
///
/// The manifest's `range`, `nonFinite` and `activeVoxels` of a step are those of the simulation's field; a
/// reconstruction with a tolerance E has the same non-finite voxels and stays within E of the range.
/// `changedVoxels` and `stateChecksum` are of the reconstruction.
///
/// An error of any stage ends the run after what was compared before it is written; likewise `stop`, which
/// throws Interrupted. The manifest is valid after every step.
void runStaticPhase(const InputSeries& input, SequenceWriter& writer, const std::string& directory,
                    ThreadPool& pool, const StopFlag& stop, const StaticPhaseReports& reports);

/// The manifest of a sequence of `input` that has no steps yet.
SequenceManifest emptyManifest(const InputSeries& input, double tolerance, int keyEvery);

}  // namespace kairos
