#include "app/bench_records.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "app/text_format.h"

namespace kairos {
namespace {

using Frames = std::vector<const BenchFrame*>;

double squared(double x) {
  return x * x;
}

template <class Value>
double meanOf(const Frames& frames, Value value) {
  double sum = 0;
  for (const BenchFrame* f : frames) sum += double(value(*f));
  return frames.empty() ? 0 : sum / double(frames.size());
}

template <class Value>
std::vector<double> valuesOf(const Frames& frames, Value value) {
  std::vector<double> values;
  for (const BenchFrame* f : frames) values.push_back(value(*f));
  return values;
}

Frames updatesOf(const BenchReport& report, size_t benchCase) {
  Frames frames;
  for (const BenchFrame& f : report.frames)
    if (f.benchCase == benchCase && !f.first) frames.push_back(&f);
  return frames;
}

Conformity conformityOf(const Frames& frames, double budgetMs) {
  Conformity c;
  std::vector<double> deviations;
  for (const BenchFrame* f : frames) {
    const double share = f->totalMs / budgetMs;
    c.shares.push_back(share);
    c.latest = std::max(c.latest, share);
    c.over += share > 1;
    if (share < 1 && f->exact())
      ++c.early;
    else
      deviations.push_back(std::abs(share - 1));
  }
  c.frames = deviations.size();
  c.deviation = spreadOf(std::move(deviations));
  return c;
}

std::optional<EstimateQuality> estimateOf(const Frames& frames) {
  EstimateQuality quality;
  std::vector<double> ratios;
  for (const BenchFrame* f : frames) {
    const auto& estimate = f->statistics.error;
    if (!estimate || (estimate->high == 0 && f->exact())) continue;
    ++quality.frames;
    quality.covered += f->error.rmse >= estimate->low && f->error.rmse <= estimate->high;
    if (f->error.rmse > 0) ratios.push_back(estimate->rmse / f->error.rmse);
  }
  if (quality.frames == 0) return std::nullopt;
  quality.ratio = median(std::move(ratios));
  return quality;
}

void addErrors(CaseSummary& s, const Frames& frames) {
  double worst = 0;
  for (const BenchFrame* f : frames) {
    s.exactFrames += f->exact();
    s.largest = std::max(s.largest, f->error.max);
    worst = std::max(worst, f->error.rmse);
  }
  s.rmse = std::sqrt(meanOf(frames, [](const BenchFrame& f) { return squared(f.error.rmse); }));
  s.psnr = psnrOf(s.rmse);
  s.worstPsnr = psnrOf(worst);
}

void addTimes(CaseSummary& s, const Frames& frames) {
  s.timeMs = spreadOf(valuesOf(frames, [](const BenchFrame& f) { return f.totalMs; }));
  s.updateMs = meanOf(frames, [](const BenchFrame& f) { return f.statistics.updateMs; });
  s.selectMs = meanOf(frames, [](const BenchFrame& f) { return f.statistics.selectMs; });
  s.castMs = meanOf(frames, [](const BenchFrame& f) { return f.statistics.castMs; });
  s.composeMs = meanOf(frames, [](const BenchFrame& f) { return f.statistics.composeMs; });
  s.otherMs = std::max(0.0, s.timeMs.mean - s.updateMs - s.selectMs - s.castMs - s.composeMs);
}

}  // namespace

double quantile(const std::vector<double>& sorted, double p) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double at = p * double(sorted.size() - 1);
  const size_t below = size_t(at);
  const double above = sorted[std::min(below + 1, sorted.size() - 1)];
  return sorted[below] + (at - double(below)) * (above - sorted[below]);
}

Spread spreadOf(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double p) { return quantile(values, p); };
  return {values.front(),
          at(0.05),
          at(0.25),
          at(0.5),
          at(0.75),
          at(0.95),
          at(0.99),
          values.back(),
          std::accumulate(values.begin(), values.end(), 0.0) / double(values.size())};
}

CaseSummary summarise(const BenchReport& report, size_t benchCase) {
  const Frames frames = updatesOf(report, benchCase);
  const BenchCase& c = report.cases[benchCase];
  CaseSummary s;
  s.frames = frames.size();
  if (frames.empty()) return s;
  addTimes(s, frames);
  addErrors(s, frames);
  s.samples = meanOf(frames, [](const BenchFrame& f) { return f.statistics.samples; });
  s.rays = meanOf(frames, [](const BenchFrame& f) { return f.statistics.raysCast; });
  s.stalePixels = meanOf(frames, [](const BenchFrame& f) { return f.statistics.stalePixels; });
  s.voxelsSampledFraction = meanOf(frames, [](const BenchFrame& f) {
    const auto& n = f.statistics;
    return n.voxelsChanged ? double(n.voxelsSampled) / double(n.voxelsChanged) : 1.0;
  });
  for (const BenchFrame* f : frames) s.tooSmall += f->statistics.budgetTooSmall;
  if (c.budget.milliseconds > 0) s.conformity = conformityOf(frames, c.budget.milliseconds);
  if (budgeted(c.method)) s.estimate = estimateOf(frames);
  return s;
}

std::string budgetName(const BenchCase& c) {
  const std::string& text = c.budgetText;
  for (const std::string unit : {"%", "ms", "fps"})
    if (text.ends_with(unit)) return text.substr(0, text.size() - unit.size()) + " " + unit;
  if (text.starts_with("samples:")) return text.substr(8) + " samples";
  if (text.starts_with("error:")) return "error " + text.substr(6);
  return text;
}

std::string caseName(const BenchCase& c) {
  const std::string budget = budgetName(c);
  return std::string(name(c.method)) + (budget.empty() ? "" : ", " + budget);
}

bool sameGroup(const BenchCase& a, const BenchCase& b) {
  return a.sampleDistance == b.sampleDistance && a.threads == b.threads;
}

}  // namespace kairos
