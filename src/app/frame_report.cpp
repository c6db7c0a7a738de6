#include "app/frame_report.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/text_format.h"
#include "core/error.h"

namespace kairos {
namespace {

double rounded(double ms) {
  return std::round(ms * 1e4) / 1e4;
}

double share(uint64_t part, uint64_t whole) {
  return whole ? double(part) / double(whole) : 0;
}

void addTo(FrameStatistics& sum, const FrameStatistics& frame) {
  sum.voxelsChanged += frame.voxelsChanged;
  sum.voxelsSampled += frame.voxelsSampled;
  sum.pixelsRecast += frame.pixelsRecast;
  sum.segmentsTotal += frame.segmentsTotal;
  sum.segmentsDirty += frame.segmentsDirty;
  sum.segmentsRecast += frame.segmentsRecast;
  sum.samples += frame.samples;
  sum.bricksVisible += frame.bricksVisible;
  sum.bricksSkipped += frame.bricksSkipped;
}

// What a frame under a budget took of it, and how far it is from the exact one. Errors are RMSE.
void addBudget(nlohmann::ordered_json& record, const RunDescription& run, const FrameTimes& times,
               const FrameStatistics& frame) {
  record["render_ms"] = rounded(times.renderMs);
  if (run.budget.milliseconds > 0) record["budget_ms"] = run.budget.milliseconds;
  if (run.budget.samples > 0) record["budget_samples"] = run.budget.samples;
  if (run.budget.error > 0) record["budget_error"] = run.budget.error;
  if (frame.predictedMs) record["predicted_ms"] = rounded(*frame.predictedMs);
  if (run.budget.limited()) record["budget_too_small"] = frame.budgetTooSmall;
  if (frame.error) {
    record["error_estimate"] = frame.error->rmse;
    record["error_low"] = frame.error->low;
    record["error_high"] = frame.error->high;
  }
  if (times.trueRmse) record["true_error"] = *times.trueRmse;
}

// A run that was killed, or whose disk was full, can leave the beginning of a record; what is appended would
// join it.
void removeHalfRecord(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  int64_t whole = file.tellg();
  const int64_t size = whole;
  for (char last = 0; whole > 0; --whole)
    if (!file.seekg(whole - 1).get(last) || last == '\n') break;
  if (whole == size) return;
  std::filesystem::resize_file(path, uint64_t(whole), error);
  if (error) throw OutputError(path, "its last, half record cannot be removed: " + error.message());
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[size_t(std::ceil(share * double(values.size() - 1)))];
}

}  // namespace

std::string frameRecord(int64_t step, const RunDescription& run, const FrameTimes& times,
                        const FrameStatistics& frame, uint64_t bytesRead, int64_t nonFinite) {
  nlohmann::ordered_json record{{"frame", step},
                                {"method", run.method},
                                {"total_ms", rounded(times.totalMs)},
                                {"load_ms", rounded(times.loadMs)},
                                {"update_ms", rounded(frame.updateMs)},
                                {"select_ms", rounded(frame.selectMs)},
                                {"cast_ms", rounded(frame.castMs)},
                                {"compose_ms", rounded(frame.composeMs)},
                                {"write_ms", rounded(times.writeMs)},
                                {"voxels_changed", frame.voxelsChanged},
                                {"voxels_sampled", frame.voxelsSampled},
                                {"pixels_changed", frame.pixelsChanged},
                                {"pixels_influenced", frame.pixelsInfluenced},
                                {"pixels_recast", frame.pixelsRecast},
                                {"segments_total", frame.segmentsTotal},
                                {"segments_dirty", frame.segmentsDirty},
                                {"segments_recast", frame.segmentsRecast},
                                {"samples", frame.samples},
                                {"ray_points", frame.rayPoints},
                                {"bricks_visible", frame.bricksVisible},
                                {"bricks_skipped", frame.bricksSkipped},
                                {"gradients", frame.gradients},
                                {"bytes_read", bytesRead},
                                {"stale_pixels", frame.stalePixels},
                                {"rays_cast", frame.raysCast},
                                {"step_level", frame.stepLevel},
                                {"threads", run.threads},
                                {"isa", run.isa},
                                {"non_finite", nonFinite}};
  addBudget(record, run, times, frame);
  return record.dump();
}

StatsFile::StatsFile(const std::string& path, bool append) : path_(path) {
  if (path_.empty()) return;
  if (append) removeHalfRecord(path_);
  file_.open(path_, append ? std::ios::app : std::ios::trunc);
  if (!file_) throw OutputError(path_, std::string("cannot be opened for --stats: ") + std::strerror(errno));
}

void StatsFile::write(const std::string& record) {
  if (path_.empty()) return;
  file_ << record << '\n' << std::flush;
  if (!file_) throw OutputError(path_, std::string("cannot be written: ") + std::strerror(errno));
}

void RunSummary::add(const FrameStatistics& frame, const FrameTimes& times, bool first) {
  ++frames_;
  totalMs_ += times.totalMs;
  castMs_ += frame.castMs;
  longestMs_ = std::max(longestMs_, times.totalMs);
  addTo(sum_, frame);
  if (first) return;
  addTo(updates_, frame);
  renderMs_.push_back(times.renderMs);
  tooSmall_ += frame.budgetTooSmall;
  if (frame.error) {
    ++estimated_;
    exact_ += frame.error->rmse == 0;
    squaredError_ += frame.error->rmse * frame.error->rmse;
    worstError_ = std::max(worstError_, frame.error->high);
  }
  if (times.trueRmse) {
    ++verified_;
    squaredTrueError_ += *times.trueRmse * *times.trueRmse;
    worstTrueError_ = std::max(worstTrueError_, *times.trueRmse);
  }
}

// How the budget was kept, and how wrong the frames may be.
std::string RunSummary::budgetText(const RunDescription& run) const {
  if (renderMs_.empty()) return "";
  std::string text;
  if (run.budget.milliseconds > 0)
    text += formatted(
        "budget %.2f ms: half the frames took %.2f ms or less, 95 %% %.2f ms or less, the longest "
        "%.2f ms\n",
        run.budget.milliseconds, percentile(renderMs_, 0.5), percentile(renderMs_, 0.95),
        percentile(renderMs_, 1));
  if (tooSmall_)
    text += "the budget was too small for the coarsest image in " + countText(tooSmall_, "frame") +
            ": parts of them show earlier steps\n";
  if (estimated_)
    text += formatted(
        "%s of %s exact; the RMSE is about %.2g over all of them, in no frame above %.2g (95 %% "
        "confidence for each)\n",
        exact_ ? std::to_string(exact_).c_str() : "none", countText(estimated_, "frame").c_str(),
        std::sqrt(squaredError_ / double(estimated_)), worstError_);
  if (verified_)
    text += formatted("verified: the true RMSE is %.3g over all frames, at most %.3g in one\n",
                      std::sqrt(squaredTrueError_ / double(verified_)), worstTrueError_);
  return text;
}

// How the methods that project voxels fared after the first frame.
std::string RunSummary::projectionText(const RunDescription& run) const {
  if (!updates_.voxelsChanged) return "";
  const uint64_t pixels = (frames_ - 1) * uint64_t(run.width) * uint64_t(run.height);
  const std::string voxels =
      run.method == "tldvrm"
          ? countText(updates_.voxelsSampled, "voxel") + " for " +
                countText(updates_.voxelsChanged, "changed one")
          : percentText(share(updates_.voxelsSampled, updates_.voxelsChanged)) + " of the changed voxels";
  return "after the first frame " + percentText(share(updates_.pixelsRecast, pixels)) +
         " of the pixels were cast, chosen by projecting " + voxels + "\n";
}

std::string RunSummary::text(const RunDescription& run, size_t kept, double seconds,
                             uint64_t memoryBytes) const {
  std::string text = formatted(
      "%s of %dx%d in %s (%.1f a second, method %s, %s, %s)\n", countText(frames_, "frame").c_str(),
      run.width, run.height, durationText(seconds).c_str(), seconds > 0 ? double(frames_) / seconds : 0.0,
      run.method.c_str(), countText(uint64_t(run.threads), "thread").c_str(), run.isa.c_str());
  if (kept)
    text += "kept " + countText(kept, "frame") + ": an earlier run with the same settings finished them\n";
  if (!frames_) return text;
  text += formatted(
      "a frame took %.1f ms from its step to its image, %.1f of them casting; the longest %.1f ms\n",
      totalMs_ / double(frames_), castMs_ / double(frames_), longestMs_);
  if (run.budget.limited() || verified_) text += budgetText(run);
  const uint64_t bricks = sum_.bricksVisible + sum_.bricksSkipped;
  text += "skipped " + percentText(share(sum_.bricksSkipped, bricks)) +
          " of the brick grid: nothing there is visible under this transfer function\n";
  if (run.method == "segments" && updates_.segmentsTotal)
    text += "after the first frame " + percentText(share(updates_.segmentsRecast, updates_.segmentsTotal)) +
            " of the ray segments were integrated; the rest shows nothing, or no voxel it reads changed\n";
  if (run.method == "dvrm" || run.method == "tldvrm" || run.method == "tcdvrm") text += projectionText(run);
  if (run.exact && run.method != "full") text += "Every frame has the same bits as a full render\n";
  text += "memory: " + byteText(double(memoryBytes)) + " for bricks, segment lists and reusable segments\n";
  return text;
}

}  // namespace kairos
