// Comparing two animations frame by frame.
#pragma once

#include <string>
#include <vector>

#include "core/image_difference.h"
#include "core/parallel.h"
#include "core/progress.h"

namespace kairos {

struct FramePair {
  std::string a, b;
  int64_t step = 0;
};

/// The frames of two sides, each a file, a directory, or a pattern with `####`, `%04d` or wildcards. Frames
/// belong together by their step number; two single files always do. Throws InputError naming the frames that
/// stand on one side only.
std::vector<FramePair> matchFrames(const std::string& a, const std::string& b);

struct ComparedFrame {
  FramePair frames;
  ImageDifference difference;
};

/// In the order of `frames`. Throws InputError, OptionError naming both files when their sizes differ, and
/// Interrupted.
std::vector<ComparedFrame> compareFrames(const std::vector<FramePair>& frames, ThreadPool& pool,
                                         const StopFlag& stop, const ProgressCallback& progress);

/// Over all frames; `worst` is the frame with the largest RMSE.
struct ComparisonSummary {
  ImageDifference mean;  // psnr: of the mean squared error; max: the largest
  size_t worst = 0;
  size_t different = 0;  // frames that are not equal
};
ComparisonSummary summarise(const std::vector<ComparedFrame>& frames);

}  // namespace kairos
