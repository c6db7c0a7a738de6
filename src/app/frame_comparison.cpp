#include "app/frame_comparison.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>

#include "app/text_format.h"
#include "core/error.h"
#include "io/image_file.h"
#include "io/input_series.h"

namespace kairos {

namespace {

void requireNoDirectory(const std::string& side) {
  std::error_code error;
  if (std::filesystem::is_directory(side, error))
    throw InputError(side, "is a directory; expected an image or a pattern such as " +
                               (std::filesystem::path(side) / "frame.####.exr").string());
}

/// Frames of one side that the other lacks.
std::string missing(const std::map<int64_t, std::string>& from, const std::map<int64_t, std::string>& in,
                    const std::string& name) {
  std::vector<std::string> steps;
  for (const auto& [step, path] : from)
    if (!in.contains(step)) steps.push_back(std::to_string(step));
  if (steps.empty()) return {};
  return name + " has no frame " + listText(steps, 10);
}

std::map<int64_t, std::string> byStep(const std::vector<StepFile>& files) {
  std::map<int64_t, std::string> map;
  for (const StepFile& f : files) map[f.step] = f.path;
  return map;
}

ImageDifference compareFiles(const FramePair& pair) {
  const Image a = readImage(pair.a), b = readImage(pair.b);
  if (a.width != b.width || a.height != b.height)
    throw InputError(pair.b, formatted("has %d x %d pixels, expected %d x %d as in ", b.width, b.height,
                                       a.width, a.height) +
                                 pair.a);
  return compareImages(a, b);
}

}  // namespace

std::vector<FramePair> matchFrames(const std::string& a, const std::string& b) {
  for (const std::string* side : {&a, &b}) requireNoDirectory(*side);
  const std::vector<StepFile> filesA = findStepFiles({a}), filesB = findStepFiles({b});
  if (filesA.size() == 1 && filesB.size() == 1) return {{filesA[0].path, filesB[0].path, filesA[0].step}};
  const auto stepsA = byStep(filesA), stepsB = byStep(filesB);
  for (const std::string& problem : {missing(stepsA, stepsB, b), missing(stepsB, stepsA, a)})
    if (!problem.empty()) throw InputError("compare", problem + ", which the other side has");
  std::vector<FramePair> pairs;
  for (const auto& [step, path] : stepsA) pairs.push_back({path, stepsB.at(step), step});
  return pairs;
}

std::vector<ComparedFrame> compareFrames(const std::vector<FramePair>& frames, ThreadPool& pool,
                                         const StopFlag& stop, const ProgressCallback& progress) {
  std::vector<ComparedFrame> compared(frames.size());
  std::mutex mutex;
  int64_t done = 0;
  pool.forEach(frames.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      stop.check();
      compared[i] = {frames[i], compareFiles(frames[i])};
      const std::lock_guard lock(mutex);
      if (progress) progress(++done, int64_t(frames.size()));
    }
  });
  return compared;
}

ComparisonSummary summarise(const std::vector<ComparedFrame>& frames) {
  ComparisonSummary summary;
  double squares = 0;
  summary.mean.ssim = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    const ImageDifference& d = frames[i].difference;
    const double share = 1.0 / double(frames.size());
    summary.mean.rmse += d.rmse * share;
    summary.mean.max = std::max(summary.mean.max, d.max);
    summary.mean.ssim += d.ssim * share;
    summary.mean.flip += d.flip * share;
    squares += d.rmse * d.rmse * share;
    summary.different += d.max > 0;
    if (d.rmse > frames[summary.worst].difference.rmse) summary.worst = i;
  }
  summary.mean.psnr = squares > 0 ? -10 * std::log10(squares) : std::numeric_limits<double>::infinity();
  return summary;
}

}  // namespace kairos
