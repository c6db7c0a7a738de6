// What a run tells about its frames: a line of JSON each, and a summary at the end.
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "app/step_source.h"
#include "diff/frame_renderer.h"

namespace kairos {

/// What one frame took, beyond what the renderer knows.
struct FrameTimes {
  double totalMs = 0;              // from waiting for the step to its image
  double loadMs = 0;               // reading the step, ahead of time
  double writeMs = 0;              // writing the files, behind
  double renderMs = 0;             // of totalMs, what a budget limits: from the step at hand to its image
  std::optional<double> trueRmse;  // against the exact frame, where that was rendered too
};

/// How a run renders, the same for all frames.
struct RunDescription {
  std::string method, isa;
  int threads = 1, width = 0, height = 0;
  Budget budget;
  bool exact = true;  // every frame has the bits of a full render
};

/// One JSON object, without the line's end.
std::string frameRecord(int64_t step, const RunDescription& run, const FrameTimes& times,
                        const FrameStatistics& frame, uint64_t bytesRead, int64_t nonFinite);

/// The --stats file: one record a line, each flushed. Not thread-safe.
class StatsFile {
 public:
  /// An empty path writes nothing. Appending goes on behind the last whole record. Throws OutputError.
  StatsFile(const std::string& path, bool append);
  void write(const std::string& record);

 private:
  std::string path_;
  std::ofstream file_;
};

/// Adds up frames for the summary.
class RunSummary {
 public:
  void add(const FrameStatistics& frame, const FrameTimes& times, bool first);
  /// Several lines for people. `seconds` is the whole run's time, `kept` counts frames that stood already.
  std::string text(const RunDescription& run, size_t kept, double seconds, uint64_t memoryBytes) const;

 private:
  size_t frames_ = 0;
  double totalMs_ = 0, longestMs_ = 0, castMs_ = 0;
  std::string budgetText(const RunDescription& run) const;
  std::string projectionText(const RunDescription& run) const;

  FrameStatistics sum_, updates_;  // of all frames; of all but the first
  // Of all but the first, under a budget.
  std::vector<double> renderMs_;
  double squaredError_ = 0, worstError_ = 0, squaredTrueError_ = 0, worstTrueError_ = 0;
  size_t estimated_ = 0, exact_ = 0, verified_ = 0, tooSmall_ = 0;
};

}  // namespace kairos
