#include "app/bench_page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "app/bench_sections.h"
#include "app/bench_style.h"
#include "app/page_html.h"
#include "app/text_format.h"
#include "plot/svg.h"

namespace kairos {
namespace {

using plot::escaped;

// Cases under one budget, the nearest to the exact frame first.
std::vector<size_t> ranked(const BenchView& view, const std::string& budget) {
  std::vector<size_t> cases = view.casesUnder(view.groups.front(), budget);
  std::stable_sort(cases.begin(), cases.end(),
                   [&](size_t a, size_t b) { return view.summaries[a].rmse < view.summaries[b].rmse; });
  return cases;
}

std::string titleOf(const BenchReport& report) {
  const std::filesystem::path path = report.sequence.name;
  const std::string name = path.has_filename() ? path.filename() : path.parent_path().filename();
  return name.empty() ? report.sequence.name : name;
}

std::string decibels(double psnr, size_t benchCase, const char* entry) {
  return numberHtml(psnr, 1, casePointer(benchCase, entry)) + (std::isfinite(psnr) ? " dB" : "");
}

// "Under 10 % (4.20 ms) anytime is nearest: 57.3 dB, 2.1 dB above lowres."
std::string sentence(const BenchView& view, const std::string& budget) {
  const std::vector<size_t> cases = ranked(view, budget);
  if (cases.empty()) return "";
  const BenchCase& best = view.at(cases.front());
  const CaseSummary& s = view.summaries[cases.front()];
  std::string text = "<li>Under <b>" + escaped(budgetName(best)) + "</b>";
  if (best.budget.milliseconds > 0)
    text += " (" + numberHtml(best.budget.milliseconds, 2, casePointer(cases.front(), "budget_ms")) + " ms)";
  text += std::string(" <b style=\"color:") + methodColour(best.method) + "\">" + name(best.method) +
          "</b> is nearest to the exact frame: " + decibels(s.psnr, cases.front(), "error/psnr");
  if (cases.size() > 1)
    text += "; next is " + std::string(name(view.at(cases[1]).method)) + " with " +
            decibels(view.summaries[cases[1]].psnr, cases[1], "error/psnr");
  return text + ".</li>";
}

std::string exactSentence(const BenchView& view) {
  const BenchGroup& group = view.groups.front();
  const size_t full = view.fullCase(group);
  size_t fastest = full;
  for (const size_t i : group.cases)
    if (!budgeted(view.at(i).method) &&
        view.summaries[i].timeMs.median < view.summaries[fastest].timeMs.median)
      fastest = i;
  const auto ms = [&](size_t i) {
    return numberHtml(view.summaries[i].timeMs.median, 2, casePointer(i, "time_ms/median")) + " ms";
  };
  std::string text = "A step rendered in full takes " + ms(full);
  if (fastest != full)
    text += "; the fastest exact method, " + std::string(name(view.at(fastest).method)) + ", takes " +
            ms(fastest);
  return "<p class=\"summary\">" + text + " (medians).</p>";
}

// Methods against budgets.
std::string overview(const BenchView& view) {
  if (view.budgets.empty()) return "";
  const BenchGroup& group = view.groups.front();
  std::vector<std::string> headers{"PSNR, dB"};
  std::vector<size_t> best;
  for (const std::string& budget : view.budgets) {
    const std::vector<size_t> cases = ranked(view, budget);
    best.push_back(cases.empty() ? view.report.cases.size() : cases.front());
    headers.push_back(cases.empty() ? budget : budgetName(view.at(cases.front())));
  }
  HtmlTable table(headers);
  for (const Method method : view.methods(group, true)) {
    table.row(name(method), methodColour(method));
    for (const size_t i : view.casesOf(group, method))
      table.number(numberHtml(view.summaries[i].psnr, 1, casePointer(i, "error/psnr")),
                   std::find(best.begin(), best.end(), i) != best.end());
  }
  return "<div class=\"overview\">" + std::move(table).finished() +
         "</div><p class=\"note\">Higher is nearer to the exact frame; of the mean squared error over all "
         "steps. "
         "The best "
         "of each budget is emphasised.</p>";
}

std::string busyWarning(const BenchReport& report) {
  if (report.processorTime) return "";
  const BenchMachine& m = report.machine;
  const double load = std::max(m.loadBefore, m.loadAfter - 1);  // this program itself makes about one
  if (load < 0.3 * m.processors + 0.2) return "";
  return "<p class=\"warning\">The machine was busy with other work while this was measured (load average " +
         numberHtml(m.loadBefore, 2, "/machine/load_before") + " before and " +
         numberHtml(m.loadAfter, 2, "/machine/load_after") + " after, with " +
         numberHtml(m.processors, 0, "/machine/processors") +
         " processors). Times are longer and less steady than the methods themselves; errors under a budget "
         "of time "
         "suffer too.</p>";
}

std::string fact(const std::string& term, const std::string& description) {
  return "<dt>" + term + "</dt><dd>" + description + "</dd>";
}

std::string facts(const BenchReport& r) {
  const BenchMachine& m = r.machine;
  const BenchSequence& s = r.sequence;
  return "<dl>" +
         fact("Sequence", escaped(s.name) + ": " + formatted("%d × %d × %d ", s.dims.x, s.dims.y, s.dims.z) +
                              s.elementType + ", steps " + std::to_string(s.steps.front()) + " to " +
                              std::to_string(s.steps.back()) + "; a step changes " +
                              percentHtml(s.changedFraction, 2, "/sequence/changed_fraction_median") +
                              " of the voxels (median; at most " +
                              percentHtml(s.largestChangedFraction, 2, "/sequence/changed_fraction_max") +
                              ")") +
         fact("Picture", numberHtml(r.width, 0, "/picture/width") + " × " +
                             numberHtml(r.height, 0, "/picture/height") + ", " + escaped(r.picture)) +
         fact("Machine", escaped(m.processor) + ", " + countText(uint64_t(m.processors), "processor") + ", " +
                             byteText(double(m.memoryBytes)) + " memory, " + escaped(m.system)) +
         fact("Program", "Kairos " + escaped(r.version) + ", " + escaped(m.compiler) + ", kernels for " +
                             escaped(m.isa)) +
         fact("Measured", escaped(r.created) + ", " + countText(uint64_t(r.repeats), "repeat") +
                              (r.processorTime ? ", times by the processor's clock" : "") +
                              "; data: <a href=\"report.json\">report.json</a>, <a "
                              "href=\"frames.csv\">frames.csv</a>") +
         fact("Command", "<code>" + escaped(r.command) + "</code>") + "</dl>";
}

std::string measured() {
  return "<section id=\"measured\"><h2>How it was measured</h2><p class=\"lead\">Each case renders the whole "
         "sequence "
         "by itself, from its first step to its last, before the next begins. The clock runs from the moment "
         "a step's "
         "changes are handed over until its image is finished: updating the volume, choosing what to cast, "
         "casting, "
         "interpolating, validating. Reading from disk and comparing with the exact frame happen in between "
         "and are "
         "not counted. <i>Exact</i> is the image of <code>full</code> at the same sample distance; errors "
         "are over all "
         "four premultiplied linear channels of all pixels. A budget in per cent is that share of the median "
         "time of "
         "<code>full</code> with as many threads in the same run.</p></section>";
}

std::string groupName(const BenchGroup& group) {
  return formatted("sample distance %g, ", group.sampleDistance) +
         countText(uint64_t(group.threads), "thread");
}

std::string groupSections(const BenchView& view, const BenchGroup& group) {
  return paretoSection(view, group) + timeSection(view, group) + errorSection(view, group) +
         conformitySection(view, group) + estimateSection(view, group) + stageSection(view, group);
}

// Links to the sections that are there.
std::string navigation(const std::string& body) {
  static const std::pair<const char*, const char*> kSections[] = {{"pareto", "Time against error"},
                                                                  {"time", "Time"},
                                                                  {"error", "Error"},
                                                                  {"conformity", "Budgets kept"},
                                                                  {"estimate", "Estimate"},
                                                                  {"stages", "Stages"},
                                                                  {"influence", "Influence"},
                                                                  {"pictures", "Pictures"},
                                                                  {"scaling", "Threads, distance"},
                                                                  {"measured", "Method"}};
  std::string html = "<nav>";
  for (const auto& [id, title] : kSections)
    if (body.find("<section id=\"" + std::string(id) + "\"") != std::string::npos)
      html += std::string("<a href=\"#") + id + "\">" + title + "</a>";
  return html + "</nav>";
}

std::string header(const BenchView& view) {
  const BenchReport& r = view.report;
  const BenchGroup& group = view.groups.front();
  std::string html =
      "<p class=\"eyebrow\">Kairos bench</p><h1>" + escaped(titleOf(r)) + ": " +
      countText(view.methods(group, true).size() + view.methods(group, false).size(), "method") + ", " +
      countText(view.budgets.size(), "budget") + ", " + countText(r.sequence.steps.size(), "step") + "</h1>" +
      exactSentence(view);
  std::string best;
  for (const std::string& budget : view.budgets) best += sentence(view, budget);
  if (!best.empty()) html += "<ul class=\"summary\">" + best + "</ul>";
  return html + busyWarning(r) + overview(view) + facts(r);
}

}  // namespace

std::string benchPage(const BenchReport& report) {
  const BenchView view(report);
  const BenchGroup& first = view.groups.front();
  std::string body = groupSections(view, first) + influenceSection(view) + pictureSection(view) +
                     scalingSection(view) + measured();
  std::string rest;
  for (size_t i = 1; i < view.groups.size(); ++i)
    rest += "<section><details><summary>The same with " + groupName(view.groups[i]) + "</summary>" +
            groupSections(view, view.groups[i]) + "</details></section>";
  const std::string heading = view.groups.size() > 1
                                  ? "<p class=\"note\">The following is for " + groupName(first) +
                                        "; the other combinations are further down.</p>"
                                  : "";
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>" +
         escaped(titleOf(report)) + " – Kairos bench</title><style>" + kBenchStyle + plot::chartStyle() +
         formatted(":root{--aspect:%d/%d}", report.width, report.height) + "</style></head><body><header>" +
         header(view) + navigation(body) + "</header><main>" + heading + body + rest + "</main><script>" +
         kBenchScript + "</script></body></html>\n";
}

}  // namespace kairos
