// Charts over two axes: lines, steps, points with error bars.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "plot/scale.h"

namespace kairos::plot {

enum class Marker { none, circle, square, diamond, triangle, ring, cross };

struct Point {
  double x = 0, y = 0;
  double low = std::numeric_limits<double>::quiet_NaN();  // error bar, where both are numbers
  double high = std::numeric_limits<double>::quiet_NaN();
  std::string note = {};  // shown when pointed at, instead of the coordinates
};

struct Series {
  std::string name;
  std::string colour;  // any CSS colour, such as "var(--anytime)"
  std::vector<Point> points;
  enum class Line { none, straight, stepped, dashed } line = Line::straight;
  Marker marker = Marker::none;
  double markerSize = 1;  // of the usual
};

/// A straight line across the chart, with its name.
struct Guide {
  double value = 0;
  std::string name, colour = "var(--muted)";
};

struct Chart {
  std::string title, xLabel, yLabel;
  std::string xUnit, yUnit;  // behind numbers in what is shown when pointed at
  Scale x, y;
  std::vector<Series> series;
  std::vector<Guide> horizontal, vertical;
  bool diagonal = false;     // the line y = x
  bool nameEnds = false;     // series' names at their right ends, where these are finite
  bool pointColumns = true;  // pointing at an x shows every series there; otherwise points show themselves
  double width = 560, height = 320;
};

/// Without colours of its own: it needs `chartStyle`, and takes the series' colours from the page.
std::string svg(const Chart& chart);

/// A sample of a series' line and marker, to stand before its name in a legend.
std::string legendSample(const Series& series);

/// The CSS of all charts. Uses the variables --text, --muted, --grid and --page.
const char* chartStyle();

}  // namespace kairos::plot
