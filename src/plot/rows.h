// Charts with a row for each case: distributions, and bars made of parts.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plot/chart.h"

namespace kairos::plot {

/// A value for every frame as a short line, a box from the first to the third quartile, and the median.
struct Distribution {
  std::string name, colour;
  std::vector<double> values;
  std::array<double, 3> quartiles{};
  std::string note;  // shown when pointed at
};

struct DistributionChart {
  std::string title, xLabel;
  Scale x;
  std::vector<Distribution> rows;
  std::vector<Guide> vertical;
  double width = 760;
};

std::string svg(const DistributionChart& chart);

/// Lengths that add up.
struct Bar {
  std::string name;
  std::vector<double> parts;
};

struct BarChart {
  std::string title, xLabel, unit;
  Scale x;  // linear from 0
  std::vector<std::string> partNames, partColours;
  std::vector<Bar> rows;
  double width = 760;
};

std::string svg(const BarChart& chart);

}  // namespace kairos::plot
