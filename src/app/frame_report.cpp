#include "app/frame_report.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
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
  sum.segmentsTotal += frame.segmentsTotal;
  sum.segmentsDirty += frame.segmentsDirty;
  sum.segmentsRecast += frame.segmentsRecast;
  sum.samples += frame.samples;
  sum.bricksVisible += frame.bricksVisible;
  sum.bricksSkipped += frame.bricksSkipped;
}

}  // namespace

std::string frameRecord(int64_t step, const RunDescription& run, const FrameTimes& times,
                        const FrameStatistics& frame, uint64_t bytesRead, int64_t nonFinite) {
  const nlohmann::ordered_json record{{"frame", step},
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
                                      {"pixels_recast", frame.pixelsRecast},
                                      {"segments_total", frame.segmentsTotal},
                                      {"segments_dirty", frame.segmentsDirty},
                                      {"segments_recast", frame.segmentsRecast},
                                      {"samples", frame.samples},
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
  return record.dump();
}

StatsFile::StatsFile(const std::string& path, bool append) : path_(path) {
  if (path_.empty()) return;
  file_.open(path_, append ? std::ios::app : std::ios::trunc);
  if (!file_) throw OutputError(path_, std::string("cannot be opened for --stats: ") + std::strerror(errno));
}

void StatsFile::write(const std::string& record) {
  if (path_.empty()) return;
  file_ << record << '\n' << std::flush;
  if (!file_) throw OutputError(path_, std::string("cannot be written: ") + std::strerror(errno));
}

void RunSummary::add(const FrameStatistics& frame, double totalMs, bool first) {
  ++frames_;
  totalMs_ += totalMs;
  castMs_ += frame.castMs;
  longestMs_ = std::max(longestMs_, totalMs);
  addTo(sum_, frame);
  if (!first) addTo(updates_, frame);
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
  const uint64_t bricks = sum_.bricksVisible + sum_.bricksSkipped;
  text += "skipped " + percentText(share(sum_.bricksSkipped, bricks)) +
          " of the brick grid: nothing there is visible under this transfer function\n";
  if (run.method == "segments" && updates_.segmentsTotal)
    text += "after the first frame " + percentText(share(updates_.segmentsRecast, updates_.segmentsTotal)) +
            " of the ray segments were integrated; the rest shows nothing, or no voxel it reads changed.\n"
            "Every frame has the same bits as a full render\n";
  text += "memory: " + byteText(double(memoryBytes)) + " for bricks, segment lists and reusable segments\n";
  return text;
}

}  // namespace kairos
