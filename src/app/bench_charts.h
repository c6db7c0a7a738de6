// The charts of a bench report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/bench_records.h"
#include "plot/chart.h"
#include "plot/rows.h"

namespace kairos {

/// Cases of equal sample distance and threads, which are compared with each other.
struct BenchGroup {
  double sampleDistance = 1;
  int threads = 1;
  std::vector<size_t> cases;
  std::string idSuffix;  // of the ids of its sections, which a page has once
};

/// A report and what is derived from it once.
struct BenchView {
  explicit BenchView(const BenchReport& report);

  const BenchReport& report;
  std::vector<CaseSummary> summaries;  // by case
  std::vector<BenchGroup> groups;      // the first is the one with pictures
  std::vector<std::string> budgets;    // as typed, in order

  const BenchCase& at(size_t benchCase) const { return report.cases[benchCase]; }
  /// Methods of a group, in order; with or without a budget.
  std::vector<Method> methods(const BenchGroup& group, bool withBudget) const;
  std::vector<size_t> casesOf(const BenchGroup& group, Method method) const;
  /// Cases under one budget, by method.
  std::vector<size_t> casesUnder(const BenchGroup& group, const std::string& budgetText) const;
  size_t fullCase(const BenchGroup& group) const { return group.cases.front(); }
};

/// CSS colours, as variables that the page's style defines.
std::string methodColour(Method method);
std::string budgetColour(const BenchView& view, const std::string& budgetText);

/// Time of each step of one method under each budget, against `full`.
plot::Chart timeChart(const BenchView& view, const BenchGroup& group, Method method);
/// Time of each step of the methods without a budget.
plot::Chart exactTimeChart(const BenchView& view, const BenchGroup& group);
/// PSNR of each step of every method under one budget.
plot::Chart errorChart(const BenchView& view, const BenchGroup& group, const std::string& budgetText);
/// PSNR over mean time, a line per method.
plot::Chart paretoChart(const BenchView& view, const BenchGroup& group);
/// Time in shares of the budget, a row per case with a limit of time.
plot::DistributionChart conformityChart(const BenchView& view, const BenchGroup& group);
/// Estimated over true RMSE of each frame of one method.
plot::Chart estimateChart(const BenchView& view, const BenchGroup& group, Method method);
/// Mean time of each stage.
plot::BarChart stageChart(const BenchView& view, const BenchGroup& group);
/// Pixels by influence number at one step: all that changed, and those one method cast under each budget.
plot::Chart influenceChart(const BenchView& view, Method method, int64_t step);
/// The share of the changed pixels of each influence number that was cast.
plot::Chart retainedChart(const BenchView& view, Method method, int64_t step);
/// Mean time of the methods without a budget over threads, or over sample distance.
plot::Chart scalingChart(const BenchView& view, bool overThreads);

}  // namespace kairos
