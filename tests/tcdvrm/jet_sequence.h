// The bundled jet as a sequence of changes, and renderers run through it.
#pragma once

#include <memory>
#include <vector>

#include "core/image_difference.h"
#include "diff/change_detection.h"
#include "support/images.h"
#include "support/scenes.h"
#include "tcdvrm/renderer_factory.h"

namespace kairos::test {

/// Steps `first` to `last` of the jet and the changes between them; everything visible changes at every step.
struct JetSequence {
  Lattice lattice;
  Field start;
  std::vector<ChangedVoxels> changes;
};
JetSequence jetSequence(int first, int last);

/// 192x192 pixels of it, about 0.4 voxels wide, sampled twice a voxel.
RenderSettings jetSettings(const TransferFunction& tf);

/// What the exact method makes of the sequence: the image and the samples of each step after the first.
struct ExactFrames {
  std::vector<Image> images;
  std::vector<uint64_t> samples;
  double meanSamples() const;
};
ExactFrames exactFrames(const JetSequence& sequence, const RenderSettings& settings);

RendererOptions withBudget(Method method, Budget budget, int threads = 1);

/// PSNR in dB of the mean squared error over all frames.
double meanPsnr(const JetSequence& sequence, const RenderSettings& settings, const RendererOptions& options,
                const ExactFrames& exact);

/// Nothing has changed.
ChangedVoxels noChanges(ElementType type);

}  // namespace kairos::test
