// The report of `kairos bench` as one HTML page that needs nothing else.
#pragma once

#include <string>

#include "app/bench_records.h"

namespace kairos {

/// Style, script, charts (SVG) and pictures (PNG) stand inside; the page refers to nothing outside itself
/// but to report.json and frames.csv beside it. Every number in its tables names its entry in report.json.
std::string benchPage(const BenchReport& report);

}  // namespace kairos
