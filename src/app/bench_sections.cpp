#include "app/bench_sections.h"

#include <algorithm>
#include <utility>

#include "app/page_html.h"
#include "app/text_format.h"
#include "plot/svg.h"

namespace kairos {
namespace {

std::string section(const std::string& id, const std::string& heading, const std::string& lead,
                    const std::string& content) {
  return "<section id=\"" + id + "\"><h2>" + heading + "</h2><p class=\"lead\">" + lead + "</p>" + content +
         "</section>";
}

std::string chartGrid(const std::vector<plot::Chart>& charts) {
  std::string html = "<div class=\"grid\">";
  for (const plot::Chart& chart : charts) html += figureHtml(svg(chart));
  return html + "</div>";
}

void nameRow(HtmlTable& table, const BenchView& view, size_t i) {
  table.row(caseName(view.at(i)), methodColour(view.at(i).method));
}

std::string milliseconds(double value, size_t benchCase, const std::string& entry) {
  return numberHtml(value, value < 100 ? 2 : 1, casePointer(benchCase, entry));
}

HtmlTable timeTable(const BenchView& view, const BenchGroup& group) {
  HtmlTable table({"case", "budget ms", "median ms", "mean ms", "5 %", "95 %", "99 %", "longest", "frames"});
  for (const size_t i : group.cases) {
    const CaseSummary& s = view.summaries[i];
    nameRow(table, view, i);
    if (view.at(i).budget.milliseconds > 0)
      table.number(milliseconds(view.at(i).budget.milliseconds, i, "budget_ms"));
    else
      table.text("–");
    const std::pair<double, const char*> columns[] = {{s.timeMs.median, "median"}, {s.timeMs.mean, "mean"},
                                                      {s.timeMs.p05, "p05"},       {s.timeMs.p95, "p95"},
                                                      {s.timeMs.p99, "p99"},       {s.timeMs.most, "max"}};
    for (const auto& [value, entry] : columns)
      table.number(milliseconds(value, i, std::string("time_ms/") + entry));
    table.number(numberHtml(double(s.frames), 0, casePointer(i, "frames")));
  }
  return table;
}

HtmlTable errorTable(const BenchView& view, const BenchGroup& group) {
  HtmlTable table({"case", "mean ms", "PSNR dB", "worst step dB", "RMSE", "largest error", "exact frames",
                   "samples", "rays", "stale pixels"});
  for (const size_t i : group.cases) {
    const CaseSummary& s = view.summaries[i];
    nameRow(table, view, i);
    table.number(milliseconds(s.timeMs.mean, i, "time_ms/mean"));
    table.number(numberHtml(s.psnr, 2, casePointer(i, "error/psnr")));
    table.number(numberHtml(s.worstPsnr, 2, casePointer(i, "error/worst_psnr")));
    table.number(smallNumberHtml(s.rmse, casePointer(i, "error/rmse")));
    table.number(smallNumberHtml(s.largest, casePointer(i, "error/max")));
    table.number(numberHtml(double(s.exactFrames), 0, casePointer(i, "error/exact_frames")));
    table.number(numberHtml(s.samples, 0, casePointer(i, "work/samples")));
    table.number(numberHtml(s.rays, 0, casePointer(i, "work/rays_cast")));
    table.number(numberHtml(s.stalePixels, 0, casePointer(i, "work/stale_pixels")));
  }
  return table;
}

}  // namespace

std::string legendHtml(const std::vector<plot::Series>& series) {
  std::string html = "<p class=\"legend\">";
  for (const plot::Series& s : series)
    html += "<span>" + plot::legendSample(s) + plot::escaped(s.name) + "</span>";
  return html + "</p>";
}

std::string casePointer(size_t benchCase, const std::string& entry) {
  return "/cases/" + std::to_string(benchCase) + "/" + entry;
}

std::string timeSection(const BenchView& view, const BenchGroup& group) {
  std::vector<plot::Chart> charts;
  for (const Method method : view.methods(group, true)) charts.push_back(timeChart(view, group, method));
  charts.push_back(exactTimeChart(view, group));
  return section(
      "time" + group.idSuffix, "Time of each step",
      "From the step handed over to its finished image; reading it from disk is not in it. Dotted lines "
      "are the budgets. Every method renders the first step whole; it is left out. Point at a chart for "
      "the numbers of a step.",
      chartGrid(charts) + numbersHtml(timeTable(view, group)));
}

std::string errorSection(const BenchView& view, const BenchGroup& group) {
  if (view.budgets.empty()) return "";
  std::vector<plot::Chart> charts;
  for (const std::string& budget : view.budgets) charts.push_back(errorChart(view, group, budget));
  return section(
      "error" + group.idSuffix, "Error of each step",
      "PSNR against the exact frame of the same step (peak 1, all four linear channels, the whole image "
      "with its background). Images that equal the exact one stand at the upper edge, and so does what is "
      "above 100 dB.",
      chartGrid(charts) + numbersHtml(errorTable(view, group)));
}

std::string paretoSection(const BenchView& view, const BenchGroup& group) {
  const plot::Chart chart = paretoChart(view, group);
  return section(
      "pareto" + group.idSuffix, "Run time against error",
      "A point per budget; up and to the left is better. Methods without a budget are exact and stand at "
      "the upper edge, at the time they take.",
      legendHtml(chart.series) + figureHtml(svg(chart)) + numbersHtml(errorTable(view, group)));
}

std::string conformitySection(const BenchView& view, const BenchGroup& group) {
  const plot::DistributionChart chart = conformityChart(view, group);
  if (chart.rows.empty()) return "";
  HtmlTable table({"case", "budget ms", "steps", "done early", "later than budget", "off by, median",
                   "off by, 95 %", "off by, 99 %", "longest / budget", "budget too small"});
  for (const size_t i : group.cases) {
    const auto& c = view.summaries[i].conformity;
    if (!c) continue;
    nameRow(table, view, i);
    table.number(milliseconds(view.at(i).budget.milliseconds, i, "budget_ms"));
    table.number(numberHtml(double(c->frames), 0, casePointer(i, "conformity/frames")));
    table.number(numberHtml(double(c->early), 0, casePointer(i, "conformity/early")));
    table.number(numberHtml(double(c->over), 0, casePointer(i, "conformity/over")));
    table.number(percentHtml(c->deviation.median, 2, casePointer(i, "conformity/deviation/median")));
    table.number(percentHtml(c->deviation.p95, 2, casePointer(i, "conformity/deviation/p95")));
    table.number(percentHtml(c->deviation.p99, 2, casePointer(i, "conformity/deviation/p99")));
    table.number(numberHtml(c->latest, 3, casePointer(i, "conformity/latest")));
    table.number(numberHtml(double(view.summaries[i].tooSmall), 0, casePointer(i, "work/budget_too_small")));
  }
  return section(
      "conformity" + group.idSuffix, "Budgets kept",
      "Every step is a thin line, the box holds the middle half, the thick line is the median. "
      "Off by: |time - budget| / budget, of the steps that needed their budget; those that had the exact "
      "frame sooner are counted as done early.",
      figureHtml(svg(chart)) + numbersHtml(std::move(table)));
}

std::string estimateSection(const BenchView& view, const BenchGroup& group) {
  std::string content;
  HtmlTable table(
      {"case", "steps with an estimate", "truth inside the interval", "estimated / true, median"});
  for (const Method method : view.methods(group, true)) {
    const plot::Chart chart = estimateChart(view, group, method);
    if (!chart.series.empty()) content += legendHtml(chart.series) + figureHtml(svg(chart));
    for (const size_t i : view.casesOf(group, method)) {
      const auto& e = view.summaries[i].estimate;
      if (!e) continue;
      nameRow(table, view, i);
      table.number(numberHtml(double(e->frames), 0, casePointer(i, "estimate/frames")));
      table.number(numberHtml(double(e->covered), 0, casePointer(i, "estimate/covered")));
      table.number(numberHtml(e->ratio, 3, casePointer(i, "estimate/ratio")));
    }
  }
  if (content.empty()) return "";
  return section(
      "estimate" + group.idSuffix, "Estimated against true error",
      "What each frame said of its own error while it was rendered, against the truth. On the dotted line "
      "both are equal; of 95 % intervals, 95 % should cross it.",
      content + numbersHtml(std::move(table)));
}

std::string stageSection(const BenchView& view, const BenchGroup& group) {
  const plot::BarChart chart = stageChart(view, group);
  HtmlTable table({"case", "update", "select", "cast", "compose", "other", "sum = mean ms"});
  for (const size_t i : group.cases) {
    const CaseSummary& s = view.summaries[i];
    nameRow(table, view, i);
    table.number(milliseconds(s.updateMs, i, "stages_ms/update"));
    table.number(milliseconds(s.selectMs, i, "stages_ms/select"));
    table.number(milliseconds(s.castMs, i, "stages_ms/cast"));
    table.number(milliseconds(s.composeMs, i, "stages_ms/compose"));
    table.number(milliseconds(s.otherMs, i, "stages_ms/other"));
    table.number(milliseconds(s.timeMs.mean, i, "time_ms/mean"));
  }
  std::string names = "<p class=\"legend\">";
  for (size_t i = 0; i < chart.partNames.size(); ++i)
    names += "<span><i class=\"dot\" style=\"color:" + chart.partColours[i] + "\"></i>" + chart.partNames[i] +
             "</span>";
  return section(
      "stages" + group.idSuffix, "Where the time goes",
      "Update: changed voxels, bricks, value ranges. Select: finding what to cast. Cast: integrating and "
      "compositing rays. Compose: assembling the image, interpolation included. Other: what the method does "
      "between these.",
      names + "</p>" + figureHtml(svg(chart)) + numbersHtml(std::move(table)));
}

std::string scalingSection(const BenchView& view) {
  if (view.groups.size() < 2) return "";
  const BenchGroup& front = view.groups.front();
  std::vector<plot::Chart> charts;
  const auto varies = [&](auto BenchGroup::*entry) {
    return std::any_of(view.groups.begin(), view.groups.end(),
                       [&](const BenchGroup& g) { return g.*entry != front.*entry; });
  };
  if (varies(&BenchGroup::threads)) charts.push_back(scalingChart(view, true));
  if (varies(&BenchGroup::sampleDistance)) charts.push_back(scalingChart(view, false));
  HtmlTable table({"case", "sample distance", "threads", "median ms", "PSNR dB"});
  for (const BenchGroup& group : view.groups)
    for (const size_t i : group.cases) {
      const CaseSummary& s = view.summaries[i];
      nameRow(table, view, i);
      table.number(numberHtml(group.sampleDistance, 3, casePointer(i, "sample_distance")));
      table.number(numberHtml(group.threads, 0, casePointer(i, "threads")));
      table.number(milliseconds(s.timeMs.median, i, "time_ms/median"));
      table.number(numberHtml(s.psnr, 2, casePointer(i, "error/psnr")));
    }
  return section(
      "scaling", "Threads and sample distance",
      "Each sample distance is compared with its own exact frames, so its error says nothing of the "
      "distance itself.",
      chartGrid(charts) + numbersHtml(std::move(table)));
}

}  // namespace kairos
