#include "app/bench_files.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/text_format.h"

namespace kairos {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

double rounded(double ms) {
  return std::round(ms * 1e4) / 1e4;
}

Json spreadJson(const Spread& s) {
  return {{"min", number(s.least)},     {"p05", number(s.p05)},  {"p25", number(s.p25)},
          {"median", number(s.median)}, {"p75", number(s.p75)},  {"p95", number(s.p95)},
          {"p99", number(s.p99)},       {"max", number(s.most)}, {"mean", number(s.mean)}};
}

Json conformityJson(const Conformity& c) {
  return {{"frames", c.frames},
          {"early", c.early},
          {"over", c.over},
          {"deviation", spreadJson(c.deviation)},
          {"latest", number(c.latest)}};
}

Json caseJson(const BenchCase& c, const CaseSummary& s) {
  Json j{{"method", name(c.method)}, {"threads", c.threads}, {"sample_distance", c.sampleDistance}};
  j["budget"] = c.budgetText.empty() ? Json(nullptr) : Json(c.budgetText);
  j["budget_ms"] = c.budget.milliseconds > 0 ? Json(rounded(c.budget.milliseconds)) : Json(nullptr);
  j["budget_samples"] = c.budget.samples > 0 ? Json(c.budget.samples) : Json(nullptr);
  j["budget_error"] = c.budget.error > 0 ? Json(c.budget.error) : Json(nullptr);
  j["frames"] = s.frames;
  j["time_ms"] = spreadJson(s.timeMs);
  j["stages_ms"] = {{"update", number(s.updateMs)},
                    {"select", number(s.selectMs)},
                    {"cast", number(s.castMs)},
                    {"compose", number(s.composeMs)},
                    {"other", number(s.otherMs)}};
  j["error"] = {{"rmse", number(s.rmse)},
                {"psnr", number(s.psnr)},
                {"worst_psnr", number(s.worstPsnr)},
                {"max", number(s.largest)},
                {"exact_frames", s.exactFrames}};
  j["work"] = {{"samples", number(s.samples)},
               {"rays_cast", number(s.rays)},
               {"stale_pixels", number(s.stalePixels)},
               {"voxels_sampled_fraction", number(s.voxelsSampledFraction)},
               {"budget_too_small", s.tooSmall}};
  j["conformity"] = s.conformity ? conformityJson(*s.conformity) : Json(nullptr);
  j["estimate"] = s.estimate ? Json{{"frames", s.estimate->frames},
                                    {"covered", s.estimate->covered},
                                    {"ratio", number(s.estimate->ratio)}}
                             : Json(nullptr);
  return j;
}

// The columns of frames.csv and the entries of a frame in report.json.
Json frameJson(const BenchFrame& f, double budgetMs) {
  const FrameStatistics& s = f.statistics;
  const auto estimate = [&](double ErrorEstimate::*entry) {
    return s.error ? number((*s.error).*entry) : Json(nullptr);
  };
  return {{"case", f.benchCase},
          {"repeat", f.repeat},
          {"step", f.step},
          {"first", f.first},
          {"load_ms", rounded(f.loadMs)},
          {"total_ms", rounded(f.totalMs)},
          {"update_ms", rounded(s.updateMs)},
          {"select_ms", rounded(s.selectMs)},
          {"cast_ms", rounded(s.castMs)},
          {"compose_ms", rounded(s.composeMs)},
          {"budget_share", budgetMs > 0 ? Json(f.totalMs / budgetMs) : Json(nullptr)},
          {"rmse", number(f.error.rmse)},
          {"psnr", number(psnrOf(f.error.rmse))},
          {"max", number(f.error.max)},
          {"error_estimate", estimate(&ErrorEstimate::rmse)},
          {"error_low", estimate(&ErrorEstimate::low)},
          {"error_high", estimate(&ErrorEstimate::high)},
          {"voxels_changed", s.voxelsChanged},
          {"voxels_sampled", s.voxelsSampled},
          {"pixels_changed", s.pixelsChanged},
          {"pixels_recast", s.pixelsRecast},
          {"stale_pixels", s.stalePixels},
          {"segments_total", s.segmentsTotal},
          {"segments_dirty", s.segmentsDirty},
          {"segments_recast", s.segmentsRecast},
          {"samples", s.samples},
          {"rays_cast", s.raysCast},
          {"step_level", s.stepLevel},
          {"budget_too_small", s.budgetTooSmall}};
}

Json machineJson(const BenchMachine& m) {
  return {{"processor", m.processor},
          {"processors", m.processors},
          {"memory_bytes", m.memoryBytes},
          {"system", m.system},
          {"compiler", m.compiler},
          {"isa", m.isa},
          {"load_before", number(m.loadBefore)},
          {"load_after", number(m.loadAfter)}};
}

Json sequenceJson(const BenchSequence& s) {
  return {{"name", s.name},
          {"dims", {s.dims.x, s.dims.y, s.dims.z}},
          {"type", s.elementType},
          {"steps", s.steps.size()},
          {"first_step", s.steps.front()},
          {"last_step", s.steps.back()},
          {"changed_fraction_median", number(s.changedFraction)},
          {"changed_fraction_max", number(s.largestChangedFraction)}};
}

Json pictureJson(const BenchPicture& p) {
  return {{"case", p.benchCase},          {"step", p.step},
          {"rmse", number(p.error.rmse)}, {"psnr", number(p.error.psnr)},
          {"max", number(p.error.max)},   {"ssim", number(p.error.ssim)},
          {"flip", number(p.error.flip)}};
}

Json histogramJson(const BenchHistogram& h) {
  return {{"case", h.benchCase},
          {"step", h.step},
          {"voxels_changed", h.voxelsChanged},
          {"voxels_sampled", h.voxelsSampled},
          {"voxels_sampled_fraction", number(h.sampledFraction())},
          {"pixels_changed", h.changedPixels()},
          {"pixels_cast", h.castPixels()},
          {"pixels_by_influence", h.changed},
          {"cast_by_influence", h.cast}};
}

}  // namespace

Json benchJson(const BenchReport& report) {
  Json j{{"kairos", report.version}, {"created", report.created}, {"command", report.command}};
  j["machine"] = machineJson(report.machine);
  j["sequence"] = sequenceJson(report.sequence);
  j["picture"] = {{"width", report.width}, {"height", report.height}, {"settings", report.picture}};
  j["clock"] = report.processorTime ? "processor" : "wall";
  j["repeats"] = report.repeats;
  for (const char* list : {"cases", "frames", "pictures", "histograms"}) j[list] = Json::array();
  for (size_t i = 0; i < report.cases.size(); ++i)
    j["cases"].push_back(caseJson(report.cases[i], summarise(report, i)));
  for (const BenchFrame& f : report.frames)
    j["frames"].push_back(frameJson(f, report.cases[f.benchCase].budget.milliseconds));
  for (const BenchPicture& p : report.pictures) j["pictures"].push_back(pictureJson(p));
  for (const BenchHistogram& h : report.histograms) j["histograms"].push_back(histogramJson(h));
  return j;
}

std::string benchCsv(const BenchReport& report) {
  std::string csv;
  for (const BenchFrame& f : report.frames) {
    const BenchCase& c = report.cases[f.benchCase];
    Json row{{"method", name(c.method)},
             {"budget", c.budgetText},
             {"budget_ms", rounded(c.budget.milliseconds)},
             {"sample_distance", c.sampleDistance},
             {"threads", c.threads}};
    row.update(frameJson(f, c.budget.milliseconds));
    std::string header, line;
    for (const auto& [key, value] : row.items()) {
      header += (header.empty() ? "" : ",") + key;
      line += (line.empty() ? "" : ",") + (value.is_string() ? value.get<std::string>()
                                           : value.is_null() ? ""
                                                             : value.dump());
    }
    if (csv.empty()) csv = header + "\n";
    csv += line + "\n";
  }
  return csv;
}

}  // namespace kairos
