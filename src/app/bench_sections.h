// The parts of a bench report's page, each a heading, what it shows, charts and their numbers.
#pragma once

#include <string>
#include <vector>

#include "app/bench_charts.h"

namespace kairos {

/// Each is empty where the report has nothing to show in it. `group` is one of the view's.
std::string timeSection(const BenchView& view, const BenchGroup& group);
std::string errorSection(const BenchView& view, const BenchGroup& group);
std::string paretoSection(const BenchView& view, const BenchGroup& group);
std::string conformitySection(const BenchView& view, const BenchGroup& group);
std::string estimateSection(const BenchView& view, const BenchGroup& group);
std::string influenceSection(const BenchView& view);
std::string pictureSection(const BenchView& view);
std::string stageSection(const BenchView& view, const BenchGroup& group);
std::string scalingSection(const BenchView& view);

/// The series' names, each behind a sample of its line.
std::string legendHtml(const std::vector<plot::Series>& series);

/// The JSON pointer of a case's entry: "/cases/3" and `entry` behind it.
std::string casePointer(size_t benchCase, const std::string& entry);

}  // namespace kairos
