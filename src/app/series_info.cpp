#include "app/series_info.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/lattice_info.h"
#include "app/text_format.h"
#include "core/error.h"
#include "core/transfer_function.h"
#include "io/file_bytes.h"

namespace kairos {

namespace {

using Json = nlohmann::ordered_json;

bool isVdbName(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".vdb";
}

VdbContainer readContainer(const std::string& path) {
  const InputFile file(path);
  ByteReader reader(file);
  return readVdbContainer(reader);
}

/// Is it the file itself in which no grid can be chosen, rather than a disagreement between files?
bool firstFileIsUndecided(const SeriesInfo& info, const InputOptions& options) {
  if (!info.container || info.container->grids.size() < 2 || !options.grid.empty() || options.raw)
    return false;
  try {
    InputSeries::open({info.firstFile}, options);
    return false;
  } catch (const InputError&) {
    return true;
  }
}

ValueRange rangeOf(const std::vector<FieldStatistics>& statistics) {
  ValueRange range{float(statistics.front().lo), float(statistics.front().hi)};
  for (const FieldStatistics& s : statistics)
    range = {std::min(range.lo, float(s.lo)), std::max(range.hi, float(s.hi))};
  return range;
}

int64_t nonFiniteOf(const std::vector<FieldStatistics>& statistics) {
  int64_t count = 0;
  for (const FieldStatistics& s : statistics) count += s.nonFinite;
  return count;
}

uint64_t bytesOf(const InputSeries& series) {
  uint64_t bytes = 0;
  for (size_t i = 0; i < series.steps().size(); ++i) bytes += series.bytes(i);
  return bytes;
}

std::string valueName(const VdbGridHeader& grid) {
  return grid.type() ? grid.type()->valueName : grid.typeName;
}

std::string activeText(const VdbGridHeader& grid) {
  const std::optional<VoxelBox> bounds = grid.activeBounds();
  return bounds ? boxText(*bounds) : "not stated";
}

std::string gridTable(const SeriesInfo& info) {
  std::string table = "\n  grids of " + info.firstFile + "\n";
  table += formatted("    %-16s%-16s%9s   %-13s %s\n", "name", "type", "size", "voxel size",
                     "active voxels within");
  for (const VdbGridHeader& grid : info.container->grids)
    table += formatted("    %-16s%-16s%9s   %-13s %s%s\n", grid.name.c_str(),
                       (valueName(grid) + (grid.half ? " (half)" : "")).c_str(),
                       byteText(double(grid.end - grid.treeBegin)).c_str(),
                       (grid.transform ? voxelSizeText(*grid.transform) : "not affine").c_str(),
                       activeText(grid).c_str(),
                       info.series && grid.name == info.series->gridName() ? "  <- read" : "");
  return table;
}

std::string seriesLines(const SeriesInfo& info) {
  const InputSeries& series = *info.series;
  const StepFile &first = series.steps().front(), &last = series.steps().back();
  std::string text = countText(series.steps().size(), "step") + ", " + std::to_string(first.step) +
                     (first.step == last.step ? "" : " to " + std::to_string(last.step)) + "\n";
  text += infoLine("files", first.path + (series.steps().size() > 1 ? " ... " + last.path : ""));
  text += latticeText(series.lattice(), series.gridName());
  text += infoLine("size", byteText(double(bytesOf(series))) + " to read");
  if (info.statistics.empty()) return text;
  const ValueRange range = rangeOf(info.statistics);
  text += infoLine("range", formatted("%.6g to %.6g over all steps", range.lo, range.hi));
  const int64_t nonFinite = nonFiniteOf(info.statistics);
  text +=
      infoLine("NaN, Inf", nonFinite == 0 ? "none" : groupedText(uint64_t(nonFinite)) + " over all steps");
  return text;
}

Json boxJson(const VoxelBox& box) {
  return {{"lo", {box.lo.x, box.lo.y, box.lo.z}}, {"hi", {box.hi.x, box.hi.y, box.hi.z}}};
}

Json gridJson(const VdbGridHeader& grid) {
  Json j;
  j["name"] = grid.name;
  j["type"] = valueName(grid);
  j["half"] = grid.half;
  j["scalar"] = grid.type() && grid.type()->scalar;
  j["bytes"] = grid.end - grid.treeBegin;
  j["active_bounds"] = nullptr;
  if (const auto bounds = grid.activeBounds()) j["active_bounds"] = boxJson(*bounds);
  j["voxel_size"] = nullptr;
  if (grid.transform)
    j["voxel_size"] = {length(grid.transform->column[0]), length(grid.transform->column[1]),
                       length(grid.transform->column[2])};
  return j;
}

Json stepsJson(const SeriesInfo& info) {
  Json steps = Json::array();
  for (size_t i = 0; i < info.series->steps().size(); ++i) {
    const StepFile& file = info.series->steps()[i];
    Json step{{"step", file.step}, {"path", file.path}, {"bytes", info.series->bytes(i)}};
    if (info.problems.empty() && i < info.statistics.size()) {
      step["range"] = {float(info.statistics[i].lo), float(info.statistics[i].hi)};
      step["non_finite"] = info.statistics[i].nonFinite;
    }
    steps.push_back(step);
  }
  return steps;
}

}  // namespace

SeriesInfo findSeries(const std::vector<std::string>& inputs, const InputOptions& options) {
  SeriesInfo info;
  info.firstFile = findStepFiles(inputs).front().path;
  if (isVdbName(info.firstFile)) info.container = readContainer(info.firstFile);
  try {
    info.series = InputSeries::open(inputs, options);
  } catch (const InputError& e) {
    if (!firstFileIsUndecided(info, options)) throw;
    info.whyNoSeries = e.what();
  }
  return info;
}

void readAll(SeriesInfo& info, const StopFlag& stop, const ProgressCallback& progress) {
  if (!info.series) return;
  const size_t count = info.series->steps().size();
  for (size_t i = 0; i < count; ++i) {
    stop.check();
    try {
      info.statistics.push_back(fieldStatistics(info.series->read(i)));
    } catch (const Error& e) {
      info.problems.push_back(e.what());
    }
    if (progress) progress(int64_t(i + 1), int64_t(count));
  }
}

std::string seriesText(const SeriesInfo& info) {
  std::string text;
  if (info.series)
    text += seriesLines(info);
  else
    text += info.whyNoSeries + "\n";
  if (info.container) text += gridTable(info);
  return text;
}

Json seriesJson(const SeriesInfo& info) {
  Json j;
  j["kind"] = info.series ? "series" : "file";
  if (info.series) {
    j.update(latticeJson(info.series->lattice(), info.series->gridName()));
    j["bytes"] = bytesOf(*info.series);
    j["steps"] = stepsJson(info);
  } else {
    j["path"] = info.firstFile;
    j["note"] = info.whyNoSeries;
  }
  if (!info.statistics.empty()) {
    const ValueRange range = rangeOf(info.statistics);
    j["range"] = {range.lo, range.hi};
    j["non_finite"] = nonFiniteOf(info.statistics);
  }
  if (!info.container) return j;
  j["grids"] = Json::array();
  for (const VdbGridHeader& grid : info.container->grids) j["grids"].push_back(gridJson(grid));
  return j;
}

}  // namespace kairos
