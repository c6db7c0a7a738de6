#include "plot/rows.h"

#include <algorithm>
#include <numeric>

#include "plot/svg.h"

namespace kairos::plot {
namespace {

constexpr double kTop = 30, kRow = 24, kBottom = 40, kLeft = 150, kRight = 16;

/// What the two kinds have in common: an axis below, names on the left.
class Rows {
 public:
  Rows(const std::string& title, const std::string& xLabel, const Scale& x, size_t rows, double width)
      : x_(x),
        right_(width - kRight),
        bottom_(kTop + kRow * double(rows)),
        svg_(width, bottom_ + kBottom, title + ": " + xLabel) {
    svg_.text(title, {{"class", "title"}, {"x", 0.0}, {"y", 14.0}});
    svg_.text(xLabel, {{"class", "label"},
                       {"x", (kLeft + right_) / 2},
                       {"y", bottom_ + kBottom - 4},
                       {"text-anchor", "middle"}});
    for (const Tick& tick : x.ticks()) {
      const double at = xOf(tick.value);
      svg_.element("line", {{"class", tick.label.empty() ? "grid minor" : "grid"},
                            {"x1", at},
                            {"x2", at},
                            {"y1", kTop},
                            {"y2", bottom_ + 4}});
      if (!tick.label.empty())
        svg_.text(tick.label, {{"class", "tick"}, {"x", at}, {"y", bottom_ + 17}, {"text-anchor", "middle"}});
    }
  }

  double xOf(double value) const { return kLeft + x_.position(value) * (right_ - kLeft); }
  double top(size_t row) const { return kTop + kRow * double(row); }
  double bottom() const { return bottom_; }
  Svg& svg() { return svg_; }

  void name(size_t row, const std::string& text, const std::string& colour) {
    svg_.text(text, {{"class", "end"},
                     {"style", "color:" + colour},
                     {"x", kLeft - 10},
                     {"y", top(row) + kRow / 2 + 4},
                     {"text-anchor", "end"}});
  }
  void target(size_t row, const std::string& note) {
    svg_.element(
        "rect", {{"class", "hover"}, {"x", 0.0}, {"y", top(row)}, {"width", right_}, {"height", kRow}}, note);
  }

 private:
  Scale x_;
  double right_, bottom_;
  Svg svg_;
};

void drawDistribution(Rows& rows, size_t row, const Distribution& d) {
  const double top = rows.top(row);
  Svg& svg = rows.svg();
  svg.openGroup({{"style", "color:" + d.colour}});
  for (const double value : d.values) {
    const double x = rows.xOf(value);
    svg.element("line", {{"class", "spread"}, {"x1", x}, {"x2", x}, {"y1", top + 5}, {"y2", top + kRow - 5}});
  }
  const double from = rows.xOf(d.quartiles[0]), to = rows.xOf(d.quartiles[2]);
  svg.element("rect",
              {{"class", "box"}, {"x", from}, {"y", top + 4}, {"width", to - from}, {"height", kRow - 8}});
  const double middle = rows.xOf(d.quartiles[1]);
  svg.element("line",
              {{"class", "middle"}, {"x1", middle}, {"x2", middle}, {"y1", top + 3}, {"y2", top + kRow - 3}});
  svg.closeGroup();
}

}  // namespace

std::string svg(const DistributionChart& chart) {
  Rows rows(chart.title, chart.xLabel, chart.x, chart.rows.size(), chart.width);
  for (const Guide& guide : chart.vertical) {
    const double x = rows.xOf(guide.value);
    rows.svg().element("line", {{"class", "guide"},
                                {"style", "color:" + guide.colour},
                                {"x1", x},
                                {"x2", x},
                                {"y1", kTop - 4},
                                {"y2", rows.bottom()}});
    rows.svg().text(guide.name, {{"class", "guide-name"},
                                 {"style", "color:" + guide.colour},
                                 {"x", x},
                                 {"y", kTop - 7},
                                 {"text-anchor", "middle"}});
  }
  for (size_t row = 0; row < chart.rows.size(); ++row) {
    const Distribution& d = chart.rows[row];
    rows.name(row, d.name, d.colour);
    if (!d.values.empty()) drawDistribution(rows, row, d);
    rows.target(row, d.name + "\n" + d.note);
  }
  return std::move(rows.svg()).finished();
}

std::string svg(const BarChart& chart) {
  Rows rows(chart.title, chart.xLabel, chart.x, chart.rows.size(), chart.width);
  for (size_t row = 0; row < chart.rows.size(); ++row) {
    const Bar& bar = chart.rows[row];
    rows.name(row, bar.name, "var(--text)");
    const double sum = std::accumulate(bar.parts.begin(), bar.parts.end(), 0.0);
    std::string note = bar.name + "  " + shortNumber(sum) + " " + chart.unit;
    double from = 0;
    for (size_t i = 0; i < bar.parts.size(); ++i) {
      const double x = rows.xOf(from), to = rows.xOf(from + bar.parts[i]);
      from += bar.parts[i];
      if (bar.parts[i] <= 0) continue;
      note += "\n" + chart.partNames[i] + "  " + shortNumber(bar.parts[i]) + " " + chart.unit;
      rows.svg().element("rect", {{"class", "part"},
                                  {"x", x},
                                  {"y", rows.top(row) + 4},
                                  {"width", to - x},
                                  {"height", kRow - 8},
                                  {"fill", chart.partColours[i]}});
    }
    rows.target(row, note);
  }
  return std::move(rows.svg()).finished();
}

}  // namespace kairos::plot
