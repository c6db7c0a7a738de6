// What the methods show at chosen steps: influence histograms, and pictures with their errors.
#include <algorithm>
#include <utility>

#include "app/bench_sections.h"
#include "app/error_map.h"
#include "app/page_html.h"
#include "app/text_format.h"
#include "plot/svg.h"

namespace kairos {
namespace {

std::vector<int64_t> stepsOf(const auto& records) {
  std::vector<int64_t> steps;
  for (const auto& r : records)
    if (std::find(steps.begin(), steps.end(), r.step) == steps.end()) steps.push_back(r.step);
  std::sort(steps.begin(), steps.end());
  return steps;
}

std::string picturePointer(size_t index, const char* entry) {
  return "/pictures/" + std::to_string(index) + "/" + entry;
}

// The exact frame lies below: hiding the picture shows it.
std::string shot(const BenchPicture& picture, const std::string& label) {
  return "<div class=\"shot exact" + std::to_string(picture.step) + "\"><img alt=\"" + plot::escaped(label) +
         "\" src=\"" + dataUri("image/png", picture.png) + "\"></div>";
}

std::string card(const BenchView& view, size_t index) {
  const BenchPicture& p = view.report.pictures[index];
  const BenchCase& c = view.at(p.benchCase);
  std::string html =
      "<figure class=\"card\"><figcaption><b><i class=\"dot\" style=\"color:" + methodColour(c.method) +
      "\"></i>" + name(c.method) + "</b> " + numberHtml(p.error.psnr, 1, picturePointer(index, "psnr")) +
      " dB</figcaption>" + shot(p, caseName(c) + ", step " + std::to_string(p.step));
  html += p.errorPng.empty() ? std::string("<div class=\"same\">equal to the exact frame</div>")
                             : "<img alt=\"error of " + plot::escaped(caseName(c)) + "\" src=\"" +
                                   dataUri("image/png", p.errorPng) + "\">";
  return html + "<figcaption>SSIM " + numberHtml(p.error.ssim, 4, picturePointer(index, "ssim")) +
         " · FLIP " + numberHtml(p.error.flip, 4, picturePointer(index, "flip")) + "</figcaption></figure>";
}

std::string errorLegend() {
  std::string html =
      "<p class=\"legend\"><span>error of the worst channel:</span><span>10⁻⁴</span><span class=\"ramp\">";
  for (int level = 0; level < kErrorLevels; ++level)
    html += "<i style=\"background:" + errorLevelColour(level) + "\"></i>";
  return html + "</span><span>1</span><span>black: equal</span></p>";
}

// Cards of one step under one budget, in the order of the cases.
std::string budgetRow(const BenchView& view, int64_t step, const std::string& budget) {
  std::string html, title;
  for (size_t i = 0; i < view.report.pictures.size(); ++i) {
    const BenchPicture& p = view.report.pictures[i];
    const BenchCase& c = view.at(p.benchCase);
    if (p.step != step || c.budgetText != budget) continue;
    html += card(view, i);
    title = plot::escaped(budgetName(c));
    if (c.budget.milliseconds > 0)
      title += " (" + numberHtml(c.budget.milliseconds, 2, casePointer(p.benchCase, "budget_ms")) + " ms)";
  }
  if (html.empty()) return "";
  return "<h4>Budget " + title + "</h4><div class=\"cards\">" + html + "</div>";
}

std::string stepPictures(const BenchView& view, int64_t step) {
  std::string exact, equal;
  for (const BenchPicture& p : view.report.pictures) {
    if (p.step != step || budgeted(view.at(p.benchCase).method)) continue;
    if (view.at(p.benchCase).method == Method::full && exact.empty())
      exact =
          "<style>.exact" + std::to_string(step) + "{background-image:url(" + dataUri("image/png", p.png) +
          ")}</style><figure class=\"card\"><figcaption><b>exact</b></figcaption><div class=\"shot exact" +
          std::to_string(step) + "\" role=\"img\" aria-label=\"exact frame of step " + std::to_string(step) +
          "\"></div></figure>";
    else if (p.errorPng.empty())
      equal += (equal.empty() ? "" : ", ") + std::string(name(view.at(p.benchCase).method));
  }
  std::string html = "<h3>Step " + std::to_string(step) + "</h3><div class=\"cards\">" + exact;
  if (!equal.empty()) html += "<p class=\"note\">Equal to it bit for bit: " + equal + ".</p>";
  html += "</div>";
  for (const std::string& budget : view.budgets) html += budgetRow(view, step, budget);
  return html;
}

HtmlTable pictureTable(const BenchView& view) {
  HtmlTable table({"case", "step", "PSNR dB", "SSIM", "FLIP", "RMSE", "largest error"});
  for (size_t i = 0; i < view.report.pictures.size(); ++i) {
    const BenchPicture& p = view.report.pictures[i];
    table.row(caseName(view.at(p.benchCase)), methodColour(view.at(p.benchCase).method));
    table.number(numberHtml(double(p.step), 0, picturePointer(i, "step")));
    table.number(numberHtml(p.error.psnr, 2, picturePointer(i, "psnr")));
    table.number(numberHtml(p.error.ssim, 5, picturePointer(i, "ssim")));
    table.number(numberHtml(p.error.flip, 5, picturePointer(i, "flip")));
    table.number(smallNumberHtml(p.error.rmse, picturePointer(i, "rmse")));
    table.number(smallNumberHtml(p.error.max, picturePointer(i, "max")));
  }
  return table;
}

HtmlTable influenceTable(const BenchView& view) {
  HtmlTable table({"case", "step", "changed voxels", "sampled", "share", "changed pixels", "cast of these"});
  for (size_t i = 0; i < view.report.histograms.size(); ++i) {
    const BenchHistogram& h = view.report.histograms[i];
    const std::string at = "/histograms/" + std::to_string(i) + "/";
    table.row(caseName(view.at(h.benchCase)), budgetColour(view, view.at(h.benchCase).budgetText));
    table.number(numberHtml(double(h.step), 0, at + "step"));
    table.number(numberHtml(double(h.voxelsChanged), 0, at + "voxels_changed"));
    table.number(numberHtml(double(h.voxelsSampled), 0, at + "voxels_sampled"));
    table.number(percentHtml(h.sampledFraction(), 1, at + "voxels_sampled_fraction"));
    table.number(numberHtml(double(h.changedPixels()), 0, at + "pixels_changed"));
    table.number(numberHtml(double(h.castPixels()), 0, at + "pixels_cast"));
  }
  return table;
}

}  // namespace

std::string influenceSection(const BenchView& view) {
  if (view.report.histograms.empty()) return "";
  std::string content;
  for (const int64_t step : stepsOf(view.report.histograms)) {
    std::vector<Method> methods;
    for (const BenchHistogram& h : view.report.histograms)
      if (h.step == step &&
          std::find(methods.begin(), methods.end(), view.at(h.benchCase).method) == methods.end())
        methods.push_back(view.at(h.benchCase).method);
    content += "<div class=\"grid\">";
    for (const Method method : methods) {
      const plot::Chart chart = influenceChart(view, method, step);
      content += figureHtml(legendHtml(chart.series) + svg(chart)) +
                 figureHtml(legendHtml(chart.series) + svg(retainedChart(view, method, step)));
    }
    content += "</div>";
  }
  return "<section id=\"influence\"><h2>Which changed pixels were cast</h2><p class=\"lead\">A pixel's "
         "influence "
         "number is how many changed voxels it sees. Sampling changed voxels at random finds the pixels with "
         "large "
         "numbers first.</p>" +
         content + numbersHtml(influenceTable(view)) + "</section>";
}

std::string pictureSection(const BenchView& view) {
  if (view.report.pictures.empty()) return "";
  std::string content = errorLegend();
  for (const int64_t step : stepsOf(view.report.pictures)) content += stepPictures(view, step);
  return "<section id=\"pictures\"><h2>Pictures</h2><p class=\"lead\">What each method shows under each "
         "budget, and "
         "below it where it is wrong. Point at a picture to see the exact frame in its place.</p>" +
         content + numbersHtml(pictureTable(view)) + "</section>";
}

}  // namespace kairos
