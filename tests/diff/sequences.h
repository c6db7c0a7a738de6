// Sequences of time steps, and running renderers through them.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "diff/differential_renderer.h"
#include "support/changes.h"
#include "support/images.h"
#include "support/scenes.h"

namespace kairos::test {

struct Sequence {
  std::string name;
  Lattice lattice;
  std::vector<Field> steps;

  Scene scene(size_t step = 0) const { return {name, lattice, steps[step]}; }
  /// The exact changes from step to step; changes()[i] leads from step i to i + 1.
  std::vector<ChangedVoxels> changes() const;
};

/// A field from voxels: background elsewhere.
Field fieldOf(const Lattice& lattice, const VoxelMap& voxels);

/// A box of voxels of one value.
VoxelMap filled(const VoxelBox& box, double value);

/// Matter behind a travelling front stands still.
Sequence frontSequence(ElementType type);
/// A ball of change in a plume that stands still.
Sequence ballSequence(ElementType type);
/// Random blocks of the size of bricks, half bricks and leaves come and go; the last step is empty.
Sequence blockSequence(ElementType type);
/// Single voxels of a plume flicker: on the domain's corners, on faces between bricks, anywhere.
Sequence flickerSequence(ElementType type);
/// One voxel in 30 changes, all over a domain full of noise.
Sequence scatterSequence(ElementType type);
/// Every voxel changes at every step.
Sequence noiseSequence(ElementType type);
/// Empty, then a plume, then nothing again, then another.
Sequence pulseSequence(ElementType type);
/// Voxels become NaN, infinite, -0.0 and huge, and finite again (f32).
Sequence nonFiniteSequence();

std::vector<Sequence> allSequences();

/// Two renderers side by side. Any frame of `segments` that is not `full`'s, bit for bit, depth included, is
/// a failure.
class FramePair {
 public:
  FramePair(const Lattice& lattice, const RenderSettings& settings, RendererOptions segments,
            int fullThreads = 1);

  [[nodiscard]] testing::AssertionResult start(const Field& field);
  [[nodiscard]] testing::AssertionResult update(const ChangedVoxels& changes);

  DifferentialRenderer& segments() { return segments_; }
  DifferentialRenderer& full() { return full_; }

 private:
  testing::AssertionResult compare() const;
  bool depth_;
  DifferentialRenderer segments_, full_;
};

RendererOptions withMethod(Method method, int threads = 1);

/// Renders the sequence from step `from` on with both methods and compares every frame.
testing::AssertionResult framesAreEqual(const Sequence& sequence, const RenderSettings& settings,
                                        const RendererOptions& segments, size_t from = 0);

}  // namespace kairos::test
