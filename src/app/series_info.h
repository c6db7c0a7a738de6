// What `kairos info` says of a simulation's files.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "io/input_series.h"
#include "io/vdb_container.h"

namespace kairos {

/// The grids of the first .vdb file, and the series as a command would read it.
struct SeriesInfo {
  std::string firstFile;
  std::optional<VdbContainer> container;  // of an OpenVDB file
  std::unique_ptr<InputSeries> series;    // null when no grid was named and none can be chosen by itself
  std::string whyNoSeries;

  /// Per step; only after `readAll`.
  std::vector<FieldStatistics> statistics;
  std::vector<std::string> problems;
};

/// Throws InputError as InputSeries::open does, except that several possible grids of one file are no error.
SeriesInfo findSeries(const std::vector<std::string>& inputs, const InputOptions& options);

/// Reads every step; what fails becomes a line of `problems`. Throws Interrupted.
void readAll(SeriesInfo& info, const StopFlag& stop, const ProgressCallback& progress);

std::string seriesText(const SeriesInfo& info);
nlohmann::ordered_json seriesJson(const SeriesInfo& info);

}  // namespace kairos
