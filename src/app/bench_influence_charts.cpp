// Influence numbers of changed pixels, and which of them a method cast: the figures 5, 8 and 11 of Liao, Lai
// and Chung 2004.
#include <algorithm>
#include <cmath>

#include "app/bench_charts.h"
#include "app/text_format.h"

namespace kairos {
namespace {

using plot::Chart;
using plot::Point;
using plot::Scale;
using plot::Series;

/// Influence numbers first to last, and how many pixels have one of these.
struct Bin {
  size_t first, last;
  double changed = 0, cast = 0;
  double width() const { return double(last - first + 1); }
};

// Bins of one number each at first, then of equal ratios, twelve to a doubling.
std::vector<Bin> binned(const BenchHistogram& h) {
  std::vector<Bin> bins;
  const double ratio = std::pow(2, 1.0 / 12);
  for (size_t first = 1; first < h.changed.size();) {
    const size_t next = std::max(first + 1, size_t(std::lround(double(first) * ratio)));
    Bin bin{first, next - 1};
    for (size_t n = first; n < std::min(next, h.changed.size()); ++n) {
      bin.changed += double(h.changed[n]);
      bin.cast += double(h.cast[n]);
    }
    bins.push_back(bin);
    first = next;
  }
  return bins;
}

std::vector<const BenchHistogram*> histogramsOf(const BenchView& view, Method method, int64_t step) {
  std::vector<const BenchHistogram*> found;
  for (const BenchHistogram& h : view.report.histograms)
    if (h.step == step && view.at(h.benchCase).method == method) found.push_back(&h);
  return found;
}

Chart axes(const BenchView& view, Method method, int64_t step,
           const std::vector<const BenchHistogram*>& all) {
  Chart chart;
  double most = 2;
  for (const BenchHistogram* h : all) most = std::max(most, double(h->changed.size()) - 1);
  chart.title = std::string(name(method)) + ", step " + std::to_string(step);
  chart.xLabel = "influence number";
  chart.x = Scale::logarithmic(1, most);
  for (const BenchHistogram* h : all) {
    Series series{budgetName(view.at(h->benchCase)),
                  budgetColour(view, view.at(h->benchCase).budgetText),
                  {},
                  Series::Line::stepped};
    chart.series.push_back(std::move(series));
  }
  return chart;
}

}  // namespace

Chart influenceChart(const BenchView& view, Method method, int64_t step) {
  const auto all = histogramsOf(view, method, step);
  Chart chart = axes(view, method, step, all);
  chart.title += ": pixels by influence number";
  chart.yLabel = "pixels per influence number";
  double most = 1, least = 1;
  Series changed{"all changed", "var(--muted)", {}, Series::Line::stepped};
  for (size_t i = 0; i < all.size(); ++i)
    for (const Bin& bin : binned(*all[i])) {
      most = std::max(most, bin.changed / bin.width());
      if (bin.changed > 0) least = std::min(least, bin.changed / bin.width());
      if (i == 0 && bin.changed > 0) changed.points.push_back({double(bin.first), bin.changed / bin.width()});
      if (bin.cast > 0) {
        chart.series[i].points.push_back({double(bin.first), bin.cast / bin.width()});
        least = std::min(least, bin.cast / bin.width());
      }
    }
  chart.series.insert(chart.series.begin(), std::move(changed));
  chart.y = Scale::logarithmic(least, most);
  return chart;
}

Chart retainedChart(const BenchView& view, Method method, int64_t step) {
  const auto all = histogramsOf(view, method, step);
  Chart chart = axes(view, method, step, all);
  chart.title += ": share of the changed pixels that was cast";
  chart.yLabel = "%";
  chart.yUnit = "%";
  chart.y = Scale::linear(0, 100);
  for (size_t i = 0; i < all.size(); ++i)
    for (const Bin& bin : binned(*all[i]))
      if (bin.changed > 0)
        chart.series[i].points.push_back({double(bin.first), 100 * bin.cast / bin.changed});
  return chart;
}

}  // namespace kairos
