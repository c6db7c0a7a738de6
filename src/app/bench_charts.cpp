#include "app/bench_charts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "app/text_format.h"

namespace kairos {
namespace {

using plot::Chart;
using plot::Marker;
using plot::Point;
using plot::Scale;
using plot::Series;

constexpr double kExact = std::numeric_limits<double>::infinity();  // PSNR of equal images
constexpr double kHighestPsnr = 100;  // shown; no display or eye tells what lies above from exact

Marker methodMarker(Method method) {
  switch (method) {
    case Method::full:
      return Marker::ring;
    case Method::segments:
      return Marker::cross;
    case Method::dvrm:
      return Marker::triangle;
    case Method::tldvrm:
      return Marker::diamond;
    case Method::anytime:
      return Marker::circle;
    case Method::tcdvrm:
      return Marker::square;
    case Method::tiles:
      return Marker::triangle;
    case Method::lowres:
      return Marker::diamond;
  }
  return Marker::circle;
}

// One point per step; of several repeats the median.
std::vector<Point> pointsByStep(const BenchView& view, size_t benchCase,
                                const std::function<double(const BenchFrame&)>& value) {
  std::map<int64_t, std::vector<double>> values;
  for (const BenchFrame& f : view.report.frames)
    if (f.benchCase == benchCase && !f.first) values[f.step].push_back(value(f));
  std::vector<Point> points;
  for (auto& [step, all] : values) points.push_back({double(step), median(std::move(all))});
  return points;
}

double timeOf(const BenchFrame& f) {
  return f.totalMs;
}

struct Extent {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();
  void add(double value) {
    if (!std::isfinite(value)) return;
    lo = std::min(lo, value);
    hi = std::max(hi, value);
  }
  bool empty() const { return lo > hi; }
};

Extent extentOf(const std::vector<Series>& series, double Point::*axis) {
  Extent extent;
  for (const Series& s : series)
    for (const Point& p : s.points) extent.add(p.*axis);
  return extent;
}

Scale stepScale(const BenchView& view) {
  const auto& steps = view.report.sequence.steps;
  return Scale::linear(double(steps.front()), double(steps.back()));
}

// In dB, with room at the top, where exact images stand.
Scale psnrScale(const std::vector<Series>& series) {
  const Extent y = extentOf(series, &Point::y);
  if (y.empty()) return Scale::linear(0, 100);
  return Scale::linear(std::min(std::floor(y.lo / 10) * 10, kHighestPsnr - 10),
                       std::min(y.hi + 4, kHighestPsnr), 7);
}

Chart timeAxes(const BenchView& view, std::string title, std::vector<Series> series) {
  Chart chart;
  chart.title = std::move(title);
  chart.xLabel = "time step";
  chart.yLabel = "ms";
  chart.yUnit = "ms";
  const Extent y = extentOf(series, &Point::y);
  chart.x = stepScale(view);
  chart.y = y.empty() ? Scale::linear(0, 1) : Scale::automatic(y.lo, y.hi);
  chart.series = std::move(series);
  chart.nameEnds = true;
  return chart;
}

}  // namespace

BenchView::BenchView(const BenchReport& r) : report(r) {
  for (size_t i = 0; i < r.cases.size(); ++i) {
    summaries.push_back(summarise(r, i));
    const BenchCase& c = r.cases[i];
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const BenchGroup& g) {
      return sameGroup(c, r.cases[g.cases.front()]);
    });
    if (group != groups.end())
      group->cases.push_back(i);
    else
      groups.push_back(
          {c.sampleDistance, c.threads, {i}, groups.empty() ? "" : std::to_string(groups.size())});
    if (!c.budgetText.empty() && std::find(budgets.begin(), budgets.end(), c.budgetText) == budgets.end())
      budgets.push_back(c.budgetText);
  }
}

std::vector<Method> BenchView::methods(const BenchGroup& group, bool withBudget) const {
  std::vector<Method> found;
  for (const size_t i : group.cases)
    if (budgeted(at(i).method) == withBudget &&
        std::find(found.begin(), found.end(), at(i).method) == found.end())
      found.push_back(at(i).method);
  return found;
}

std::vector<size_t> BenchView::casesOf(const BenchGroup& group, Method method) const {
  std::vector<size_t> found;
  for (const size_t i : group.cases)
    if (at(i).method == method) found.push_back(i);
  return found;
}

std::vector<size_t> BenchView::casesUnder(const BenchGroup& group, const std::string& budgetText) const {
  std::vector<size_t> found;
  for (const size_t i : group.cases)
    if (at(i).budgetText == budgetText) found.push_back(i);
  return found;
}

std::string methodColour(Method method) {
  return std::string("var(--") + name(method) + ")";
}

std::string budgetColour(const BenchView& view, const std::string& budgetText) {
  constexpr size_t kColours = 6;
  const auto at = std::find(view.budgets.begin(), view.budgets.end(), budgetText) - view.budgets.begin();
  return "var(--budget" + std::to_string(std::min(size_t(at), kColours - 1)) + ")";
}

Chart timeChart(const BenchView& view, const BenchGroup& group, Method method) {
  const size_t full = view.fullCase(group);
  std::vector<Series> series{{"full", methodColour(Method::full), pointsByStep(view, full, timeOf)}};
  std::vector<plot::Guide> guides;
  for (const size_t i : view.casesOf(group, method)) {
    const std::string colour = budgetColour(view, view.at(i).budgetText);
    series.push_back({budgetName(view.at(i)), colour, pointsByStep(view, i, timeOf)});
    if (view.at(i).budget.milliseconds > 0) guides.push_back({view.at(i).budget.milliseconds, "", colour});
  }
  Chart chart = timeAxes(view, name(method), std::move(series));
  chart.horizontal = std::move(guides);
  return chart;
}

Chart exactTimeChart(const BenchView& view, const BenchGroup& group) {
  std::vector<Series> series;
  for (const size_t i : group.cases)
    if (!budgeted(view.at(i).method))
      series.push_back(
          {name(view.at(i).method), methodColour(view.at(i).method), pointsByStep(view, i, timeOf)});
  return timeAxes(view, "Exact methods", std::move(series));
}

Chart errorChart(const BenchView& view, const BenchGroup& group, const std::string& budgetText) {
  Chart chart;
  const std::vector<size_t> cases = view.casesUnder(group, budgetText);
  for (const size_t i : cases)
    chart.series.push_back({name(view.at(i).method), methodColour(view.at(i).method),
                            pointsByStep(view, i, [](const BenchFrame& f) { return psnrOf(f.error.rmse); })});
  for (Series& s : chart.series)
    for (Point& p : s.points)
      if (!std::isfinite(p.y)) p.note = "exact";
  chart.title = cases.empty() ? "" : "Budget " + budgetName(view.at(cases.front()));
  chart.xLabel = "time step";
  chart.yLabel = "PSNR, dB";
  chart.yUnit = "dB";
  chart.x = stepScale(view);
  chart.y = psnrScale(chart.series);
  chart.nameEnds = true;
  return chart;
}

Chart paretoChart(const BenchView& view, const BenchGroup& group) {
  Chart chart;
  for (const bool withBudget : {true, false})
    for (const Method method : view.methods(group, withBudget)) {
      Series series{name(method), methodColour(method), {}, Series::Line::straight, methodMarker(method)};
      for (const size_t i : view.casesOf(group, method)) {
        const CaseSummary& s = view.summaries[i];
        const std::string budget = budgetName(view.at(i));
        Point point{s.timeMs.mean, s.psnr};
        point.note = (budget.empty() ? "" : "budget " + budget + "\n") + plot::shortNumber(point.x) +
                     " ms\n" + (std::isfinite(point.y) ? plot::shortNumber(point.y) + " dB" : "exact");
        series.points.push_back(std::move(point));
      }
      std::sort(series.points.begin(), series.points.end(),
                [](const Point& a, const Point& b) { return a.x < b.x; });
      chart.series.push_back(std::move(series));
    }
  const Extent x = extentOf(chart.series, &Point::x);
  chart.xLabel = "mean time of a step, ms";
  chart.yLabel = "PSNR of the mean squared error, dB: higher is nearer to the exact frame";
  chart.x = x.empty() || x.lo <= 0 ? Scale::linear(0, 1) : Scale::logarithmic(x.lo, x.hi);
  chart.y = psnrScale(chart.series);
  chart.horizontal.push_back({kExact, "exact frames (∞)"});
  chart.pointColumns = false;
  chart.nameEnds = true;
  chart.width = 860;
  chart.height = 440;
  return chart;
}

plot::DistributionChart conformityChart(const BenchView& view, const BenchGroup& group) {
  plot::DistributionChart chart;
  double least = 95, most = 105;
  for (const Method method : view.methods(group, true))
    for (const size_t i : view.casesOf(group, method)) {
      const auto& conformity = view.summaries[i].conformity;
      if (!conformity) continue;
      std::vector<double> percents;
      for (const double share : conformity->shares) percents.push_back(100 * share);
      const Spread spread = spreadOf(percents);
      least = std::min(least, spread.least);
      most = std::max(most, std::min(spread.most, 250.0));
      chart.rows.push_back(
          {caseName(view.at(i)),
           methodColour(method),
           std::move(percents),
           {spread.p25, spread.median, spread.p75},
           formatted("median %.1f %%, 5th to 95th percentile %.1f to %.1f %%, at most %.1f %%", spread.median,
                     spread.p05, spread.p95, spread.most)});
    }
  chart.title = "Time of each step in shares of its budget";
  chart.xLabel = "% of the budget (what lies beyond the axis stands at its end)";
  chart.x = Scale::linear(least, most, 8);
  chart.vertical.push_back({100, "budget", "var(--text)"});
  return chart;
}

Chart estimateChart(const BenchView& view, const BenchGroup& group, Method method) {
  Chart chart;
  Extent both;
  for (const size_t i : view.casesOf(group, method)) {
    Series series{budgetName(view.at(i)),
                  budgetColour(view, view.at(i).budgetText),
                  {},
                  Series::Line::none,
                  Marker::circle,
                  0.7};
    for (const BenchFrame& f : view.report.frames) {
      const auto& e = f.statistics.error;
      if (f.benchCase != i || f.first || !e || e->rmse <= 0 || f.error.rmse <= 0) continue;
      series.points.push_back({f.error.rmse, e->rmse, e->low, e->high,
                               formatted("step %lld\ntrue %.3g\nestimated %.3g (%.3g to %.3g)",
                                         (long long)(f.step), f.error.rmse, e->rmse, e->low, e->high)});
      both.add(f.error.rmse);
      both.add(e->rmse);
    }
    if (!series.points.empty()) chart.series.push_back(std::move(series));
  }
  chart.title = std::string(name(method)) + ": estimated against true error";
  chart.xLabel = "true RMSE";
  chart.yLabel = "estimated RMSE, with its 95 % interval";
  chart.x = chart.y = both.empty() ? Scale::linear(0, 1) : Scale::logarithmic(both.lo, both.hi);
  chart.diagonal = true;
  chart.pointColumns = false;
  chart.width = 620;
  chart.height = 460;
  return chart;
}

plot::BarChart stageChart(const BenchView& view, const BenchGroup& group) {
  plot::BarChart chart;
  double most = 0;
  for (const size_t i : group.cases) {
    const CaseSummary& s = view.summaries[i];
    chart.rows.push_back({caseName(view.at(i)), {s.updateMs, s.selectMs, s.castMs, s.composeMs, s.otherMs}});
    most = std::max(most, s.timeMs.mean);
  }
  chart.title = "Mean time of a step by stage";
  chart.xLabel = "ms";
  chart.unit = "ms";
  chart.x = Scale::linear(0, most, 8);
  chart.partNames = {"update", "select", "cast", "compose", "other"};
  for (size_t i = 0; i < chart.partNames.size(); ++i)
    chart.partColours.push_back("var(--stage" + std::to_string(i) + ")");
  return chart;
}

Chart scalingChart(const BenchView& view, bool overThreads) {
  Chart chart;
  for (const Method method : view.methods(view.groups.front(), false)) {
    Series series{name(method), methodColour(method), {}, Series::Line::straight, methodMarker(method)};
    for (const BenchGroup& group : view.groups) {
      const bool compared = overThreads ? group.sampleDistance == view.groups.front().sampleDistance
                                        : group.threads == view.groups.front().threads;
      if (!compared) continue;
      for (const size_t i : view.casesOf(group, method))
        series.points.push_back(
            {overThreads ? double(group.threads) : group.sampleDistance, view.summaries[i].timeMs.median});
    }
    std::sort(series.points.begin(), series.points.end(),
              [](const Point& a, const Point& b) { return a.x < b.x; });
    chart.series.push_back(std::move(series));
  }
  const Extent x = extentOf(chart.series, &Point::x), y = extentOf(chart.series, &Point::y);
  chart.title = overThreads ? "Median time over threads" : "Median time over sample distance";
  chart.xLabel = overThreads ? "threads" : "sample distance, voxels";
  chart.yLabel = "ms";
  chart.yUnit = "ms";
  chart.x = overThreads ? Scale::linear(0, x.hi) : Scale::automatic(x.lo, x.hi, 4);
  chart.y = Scale::automatic(y.lo, y.hi);
  chart.nameEnds = true;
  return chart;
}

}  // namespace kairos
