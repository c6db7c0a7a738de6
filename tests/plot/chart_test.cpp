// Charts as SVG: everything drawn is there, in its place, and well-formed.
#include "plot/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <string>
#include <vector>

#include "plot/rows.h"
#include "plot/svg.h"

namespace kairos::plot {
namespace {

using testing::HasSubstr;
using testing::Not;

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++found;
  return found;
}

// Every element is closed, in order.
bool wellFormed(const std::string& xml) {
  std::vector<std::string> open;
  static const std::regex tag("<(/?)([a-z]+)([^<>]*?)(/?)>");
  for (std::sregex_iterator it(xml.begin(), xml.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2];
    if ((*it)[4].length()) continue;
    if (!(*it)[1].length()) {
      open.push_back(name);
      continue;
    }
    if (open.empty() || open.back() != name) return false;
    open.pop_back();
  }
  return open.empty();
}

Chart twoLines() {
  Chart chart;
  chart.title = "Time & <more>";
  chart.xLabel = "time step";
  chart.yLabel = "ms";
  chart.yUnit = "ms";
  chart.x = Scale::linear(0, 4);
  chart.y = Scale::linear(0, 10);
  for (const char* name : {"a", "b"}) {
    Series series{name, "var(--" + std::string(name) + ")", {}};
    for (int step = 0; step <= 4; ++step)
      series.points.push_back({double(step), name[0] == 'a' ? 10.0 : 5.0});
    chart.series.push_back(series);
  }
  return chart;
}

TEST(Chart, IsWellFormedAndEscapesWhatItIsGiven) {
  const std::string text = svg(twoLines());
  EXPECT_TRUE(wellFormed(text)) << text;
  EXPECT_THAT(text, HasSubstr("Time &amp; &lt;more&gt;"));
  EXPECT_THAT(text, Not(HasSubstr("<more>")));
}

TEST(Chart, DrawsALineForEachSeriesInItsColour) {
  const std::string text = svg(twoLines());
  EXPECT_EQ(count(text, "class=\"line\""), 2);
  EXPECT_EQ(count(text, "style=\"color:var(--a)\""), 1);
}

TEST(Chart, PutsValuesWhereTheAxisHasThem) {
  // The plot runs from x = 54 to 546 and from y = 46 (10) to 280 (0).
  const std::string text = svg(twoLines());
  EXPECT_THAT(text, HasSubstr("d=\"M54 46L177 46L300 46L423 46L546 46\""));
  EXPECT_THAT(text, HasSubstr("d=\"M54 163L177 163L300 163L423 163L546 163\""));
}

TEST(Chart, TellsEverySeriesOfAnXWherePointedAt) {
  const std::string text = svg(twoLines());
  EXPECT_EQ(count(text, "class=\"hover\""), 5) << "one for each step";
  EXPECT_THAT(text, HasSubstr("<title>time step 3\na  10 ms\nb  5 ms</title>"));
}

TEST(Chart, StepsGoAcrossBeforeTheyGoUp) {
  Chart chart = twoLines();
  chart.series.resize(1);
  chart.series[0].points = {{0, 0}, {2, 10}};
  chart.series[0].line = Series::Line::stepped;
  EXPECT_THAT(svg(chart), HasSubstr("d=\"M54 280L300 280L300 46\""));
}

TEST(Chart, NamesAtTheEndsNeverOverlap) {
  Chart chart = twoLines();
  chart.nameEnds = true;
  for (const double y : {5.1, 5.2, 0.0, 0.1}) {
    chart.series.push_back({"more", "red", {{4, y}}});
  }
  const std::string text = svg(chart);
  std::vector<double> heights;
  static const std::regex end("class=\"end\"[^>]* y=\"([0-9.]+)\"");
  for (std::sregex_iterator it(text.begin(), text.end(), end), none; it != none; ++it)
    heights.push_back(std::stod((*it)[1]));
  ASSERT_EQ(heights.size(), 6u);
  for (size_t i = 1; i < heights.size(); ++i) EXPECT_GE(heights[i] - heights[i - 1], 13.99);
  EXPECT_LE(heights.back(), 284) << "inside the plot";
}

TEST(Chart, MarksEveryPointAndItsInterval) {
  Chart chart = twoLines();
  chart.series.resize(1);
  chart.series[0].marker = Marker::circle;
  chart.series[0].points[1].low = 2;
  chart.series[0].points[1].high = 8;
  chart.pointColumns = false;
  const std::string text = svg(chart);
  EXPECT_EQ(count(text, "class=\"mark\""), 5);
  EXPECT_EQ(count(text, "class=\"bar\""), 1);
  EXPECT_EQ(count(text, "class=\"hover\""), 5);
}

TEST(Chart, InfiniteValuesStandAtTheUpperEdge) {
  Chart chart = twoLines();
  chart.series.resize(1);
  chart.series[0].points = {{0, std::numeric_limits<double>::infinity()}, {4, 0}};
  EXPECT_THAT(svg(chart), HasSubstr("d=\"M54 46L546 280\""));
}

TEST(Chart, WithoutSeriesStillHasItsAxes) {
  Chart chart = twoLines();
  chart.series.clear();
  const std::string text = svg(chart);
  EXPECT_TRUE(wellFormed(text));
  EXPECT_EQ(count(text, "class=\"grid\""), 6);
}

TEST(DistributionChart, HasALineForEveryValue) {
  DistributionChart chart;
  chart.x = Scale::linear(0, 100);
  chart.rows.push_back({"first", "red", {1, 50, 50, 99}, {25, 50, 75}, "note"});
  chart.rows.push_back({"empty", "red", {}, {}, ""});
  chart.vertical.push_back({100, "budget"});
  const std::string text = svg(chart);
  EXPECT_TRUE(wellFormed(text));
  EXPECT_EQ(count(text, "class=\"spread\""), 4);
  EXPECT_EQ(count(text, "class=\"box\""), 1);
  EXPECT_THAT(text, HasSubstr("<title>first\nnote</title>"));
}

TEST(BarChart, PartsFollowOneAnother) {
  BarChart chart;
  chart.unit = "ms";
  chart.x = Scale::linear(0, 10);
  chart.partNames = {"cast", "compose", "none"};
  chart.partColours = {"red", "blue", "green"};
  chart.rows.push_back({"full", {2.5, 5, 0}});
  const std::string text = svg(chart);
  EXPECT_TRUE(wellFormed(text));
  // The axis runs from x = 150 to 744: 59.4 a unit.
  EXPECT_THAT(text, HasSubstr("x=\"150\" y=\"34\" width=\"148.5\""));
  EXPECT_THAT(text, HasSubstr("x=\"298.5\" y=\"34\" width=\"297\""));
  EXPECT_EQ(count(text, "class=\"part\""), 2);
  EXPECT_THAT(text, HasSubstr("full  7.5 ms\ncast  2.5 ms\ncompose  5 ms"));
}

TEST(Svg, EscapesAttributes) {
  Svg svg(1, 1, "\"a\"");
  svg.element("rect", {{"class", "x\" onclick=\"y"}});
  EXPECT_THAT(std::move(svg).finished(), HasSubstr("class=\"x&quot; onclick=&quot;y\""));
}

TEST(Coordinate, HasAtMostTwoDecimals) {
  EXPECT_EQ(coordinate(1.5), "1.5");
  EXPECT_EQ(coordinate(2), "2");
  EXPECT_EQ(coordinate(1.0 / 3), "0.33");
  EXPECT_EQ(coordinate(-0.001), "0");
}

}  // namespace
}  // namespace kairos::plot
