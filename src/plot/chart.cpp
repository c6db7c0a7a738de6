#include "plot/chart.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "plot/svg.h"

namespace kairos::plot {
namespace {

constexpr double kLeft = 54, kTop = 46, kBottom = 40, kRight = 14, kNames = 112;
constexpr double kLineHeight = 14;  // of names at the ends of lines
constexpr double kHitRadius = 9;    // around a point, where pointing at it counts

std::string pathOf(const std::vector<std::pair<double, double>>& points, bool stepped) {
  std::string path;
  double lastY = 0;
  for (const auto& [x, y] : points) {
    if (!path.empty() && stepped) path += "L" + coordinate(x) + " " + coordinate(lastY);
    path += (path.empty() ? "M" : "L") + coordinate(x) + " " + coordinate(y);
    lastY = y;
  }
  return path;
}

void drawMarker(Svg& svg, Marker marker, double x, double y, double size) {
  const auto polygon = [&](std::vector<std::pair<double, double>> offsets) {
    for (auto& [px, py] : offsets) px = x + size * px, py = y + size * py;
    svg.element("path", {{"class", "mark"}, {"d", pathOf(offsets, false) + "Z"}});
  };
  const auto circle = [&](const char* style, double radius) {
    svg.element("circle", {{"class", style}, {"cx", x}, {"cy", y}, {"r", size * radius}});
  };
  const auto stroke = [&](double dx, double dy) {
    return pathOf({{x - size * dx, y - size * dy}, {x + size * dx, y + size * dy}}, false);
  };
  switch (marker) {
    case Marker::none:
      return;
    case Marker::circle:
      return circle("mark", 3.6);
    case Marker::ring:
      return circle("mark hollow", 3.4);
    case Marker::square:
      return polygon({{-3.2, -3.2}, {3.2, -3.2}, {3.2, 3.2}, {-3.2, 3.2}});
    case Marker::diamond:
      return polygon({{0, -4.6}, {4.6, 0}, {0, 4.6}, {-4.6, 0}});
    case Marker::triangle:
      return polygon({{0, -4.4}, {4.2, 3.2}, {-4.2, 3.2}});
    case Marker::cross:
      svg.element("path", {{"class", "mark hollow"}, {"d", stroke(3.4, 3.4) + stroke(3.4, -3.4)}});
  }
}

std::string withUnit(double value, const std::string& unit) {
  return shortNumber(value) + (unit.empty() ? "" : " " + unit);
}

/// One chart being drawn.
class Drawing {
 public:
  explicit Drawing(const Chart& chart)
      : chart_(chart),
        svg_(chart.width, chart.height, chart.title + ": " + chart.yLabel + " over " + chart.xLabel),
        right_(chart.width - (chart.nameEnds ? kNames : kRight)),
        bottom_(chart.height - kBottom) {}

  std::string drawn() && {
    drawAxes();
    drawGuides();
    for (const Series& series : chart_.series) drawSeries(series);
    if (chart_.nameEnds) nameEnds();
    if (chart_.pointColumns)
      addColumns();
    else
      addPointTargets();
    return std::move(svg_).finished();
  }

 private:
  double xOf(double value) const { return kLeft + chart_.x.position(value) * (right_ - kLeft); }
  double yOf(double value) const { return bottom_ - chart_.y.position(value) * (bottom_ - kTop); }

  void drawAxes() {
    svg_.text(chart_.title, {{"class", "title"}, {"x", 0.0}, {"y", 14.0}});
    svg_.text(chart_.yLabel, {{"class", "label"}, {"x", 0.0}, {"y", 32.0}});
    svg_.text(chart_.xLabel, {{"class", "label"},
                              {"x", (kLeft + right_) / 2},
                              {"y", chart_.height - 4},
                              {"text-anchor", "middle"}});
    for (const Tick& tick : chart_.y.ticks()) {
      const double y = yOf(tick.value);
      svg_.element("line", {{"class", tick.label.empty() ? "grid minor" : "grid"},
                            {"x1", kLeft},
                            {"x2", right_},
                            {"y1", y},
                            {"y2", y}});
      if (!tick.label.empty())
        svg_.text(tick.label, {{"class", "tick"}, {"x", kLeft - 7}, {"y", y + 4}, {"text-anchor", "end"}});
    }
    for (const Tick& tick : chart_.x.ticks()) {
      const double x = xOf(tick.value);
      svg_.element("line", {{"class", tick.label.empty() ? "axis minor" : "axis"},
                            {"x1", x},
                            {"x2", x},
                            {"y1", bottom_},
                            {"y2", bottom_ + 4}});
      if (!tick.label.empty())
        svg_.text(tick.label, {{"class", "tick"}, {"x", x}, {"y", bottom_ + 17}, {"text-anchor", "middle"}});
    }
    svg_.element("line",
                 {{"class", "axis"}, {"x1", kLeft}, {"x2", right_}, {"y1", bottom_}, {"y2", bottom_}});
  }

  void drawGuides() {
    const auto style = [](const Guide& guide) { return "color:" + guide.colour; };
    for (const Guide& guide : chart_.horizontal) {
      const double y = yOf(guide.value);
      svg_.element(
          "line",
          {{"class", "guide"}, {"style", style(guide)}, {"x1", kLeft}, {"x2", right_}, {"y1", y}, {"y2", y}});
      svg_.text(guide.name, {{"class", "guide-name"},
                             {"style", style(guide)},
                             {"x", kLeft + 4},
                             {"y", y < kTop + kLineHeight ? y + 13 : y - 4}});
    }
    for (const Guide& guide : chart_.vertical) {
      const double x = xOf(guide.value);
      svg_.element(
          "line",
          {{"class", "guide"}, {"style", style(guide)}, {"x1", x}, {"x2", x}, {"y1", kTop}, {"y2", bottom_}});
      svg_.text(guide.name,
                {{"class", "guide-name"}, {"style", style(guide)}, {"x", x + 4}, {"y", kTop + 10}});
    }
    if (!chart_.diagonal) return;
    const double lo = std::max(chart_.x.lo(), chart_.y.lo()), hi = std::min(chart_.x.hi(), chart_.y.hi());
    svg_.element("line",
                 {{"class", "guide"}, {"x1", xOf(lo)}, {"x2", xOf(hi)}, {"y1", yOf(lo)}, {"y2", yOf(hi)}});
  }

  void drawSeries(const Series& series) {
    svg_.openGroup({{"class", "series"}, {"style", "color:" + series.colour}});
    if (series.line != Series::Line::none && !series.points.empty()) {
      std::vector<std::pair<double, double>> path;
      for (const Point& p : series.points) path.emplace_back(xOf(p.x), yOf(p.y));
      svg_.element("path", {{"class", series.line == Series::Line::dashed ? "line dashed" : "line"},
                            {"d", pathOf(path, series.line == Series::Line::stepped)}});
    }
    for (const Point& p : series.points) {
      const double x = xOf(p.x);
      if (std::isfinite(p.low) && std::isfinite(p.high))
        svg_.element("line",
                     {{"class", "bar"}, {"x1", x}, {"x2", x}, {"y1", yOf(p.low)}, {"y2", yOf(p.high)}});
      drawMarker(svg_, series.marker, x, yOf(p.y), series.markerSize);
    }
    svg_.closeGroup();
  }

  // Names stand beside their last points, pushed apart where these are close together.
  void nameEnds() {
    std::vector<std::pair<double, const Series*>> ends;
    for (const Series& series : chart_.series)
      if (!series.points.empty() && std::isfinite(series.points.back().y))
        ends.emplace_back(yOf(series.points.back().y), &series);
    std::stable_sort(ends.begin(), ends.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (size_t i = 1; i < ends.size(); ++i)
      ends[i].first = std::max(ends[i].first, ends[i - 1].first + kLineHeight);
    double floor = bottom_;
    for (size_t i = ends.size(); i-- > 0; floor -= kLineHeight)
      ends[i].first = std::min(ends[i].first, floor);
    for (const auto& [y, series] : ends)
      svg_.text(series->name,
                {{"class", "end"}, {"style", "color:" + series->colour}, {"x", right_ + 8}, {"y", y + 4}});
  }

  void addColumns() {
    std::map<double, std::string> notes;
    for (const Series& series : chart_.series)
      for (const Point& p : series.points) {
        std::string& note = notes[p.x];
        if (note.empty()) note = chart_.xLabel + " " + withUnit(p.x, chart_.xUnit);
        note += "\n" + series.name + "  " + (p.note.empty() ? withUnit(p.y, chart_.yUnit) : p.note);
      }
    for (auto at = notes.begin(); at != notes.end(); ++at) {
      const double x = xOf(at->first);
      const double from = at == notes.begin() ? kLeft : (x + xOf(std::prev(at)->first)) / 2;
      const double to = std::next(at) == notes.end() ? right_ : (x + xOf(std::next(at)->first)) / 2;
      svg_.element("rect",
                   {{"class", "hover"},
                    {"x", from},
                    {"y", kTop},
                    {"width", std::max(0.5, to - from)},
                    {"height", bottom_ - kTop}},
                   at->second);
    }
  }

  void addPointTargets() {
    for (const Series& series : chart_.series)
      for (const Point& p : series.points)
        svg_.element("circle", {{"class", "hover"}, {"cx", xOf(p.x)}, {"cy", yOf(p.y)}, {"r", kHitRadius}},
                     series.name + "\n" +
                         (p.note.empty() ? chart_.xLabel + " " + withUnit(p.x, chart_.xUnit) + "\n" +
                                               chart_.yLabel + " " + withUnit(p.y, chart_.yUnit)
                                         : p.note));
  }

  const Chart& chart_;
  Svg svg_;
  double right_, bottom_;
};

}  // namespace

std::string svg(const Chart& chart) {
  return Drawing(chart).drawn();
}

std::string legendSample(const Series& series) {
  Svg svg(26, 12, series.name);
  svg.openGroup({{"class", "series"}, {"style", "color:" + series.colour}});
  if (series.line != Series::Line::none)
    svg.element("path", {{"class", series.line == Series::Line::dashed ? "line dashed" : "line"},
                         {"d", "M1 6L25 6"}});
  drawMarker(svg, series.marker, 13, 6, 1);
  svg.closeGroup();
  return std::move(svg).finished();
}

const char* chartStyle() {
  return R"(svg{display:block;width:100%;height:auto}
svg text{font-family:inherit;fill:var(--muted);font-size:12px;font-variant-numeric:tabular-nums}
svg .title{fill:var(--text);font-size:13.5px;font-weight:600}
svg .grid{stroke:var(--grid);stroke-width:1}
svg .minor{opacity:.45}
svg .axis{stroke:var(--muted);stroke-width:1}
svg .guide{stroke:currentColor;stroke-width:1;stroke-dasharray:2 3;opacity:.85}
svg .guide-name{fill:currentColor;font-size:11px}
svg .line{fill:none;stroke:currentColor;stroke-width:1.7;stroke-linejoin:round;stroke-linecap:round}
svg .dashed{stroke-dasharray:5 4}
svg .mark{fill:currentColor;stroke:var(--page);stroke-width:1}
svg .hollow{fill:none;stroke:currentColor;stroke-width:1.7}
svg .bar{stroke:currentColor;stroke-width:1;opacity:.45}
svg .end{fill:currentColor;font-weight:600}
svg .spread{stroke:currentColor;stroke-width:1;opacity:.4}
svg .box{fill:currentColor;opacity:.28}
svg .middle{stroke:currentColor;stroke-width:2.4}
svg .part{stroke:var(--page);stroke-width:1}
svg .hover{fill:currentColor;fill-opacity:0;color:var(--text)}
svg .hover:hover{fill-opacity:.09}
)";
}

}  // namespace kairos::plot
