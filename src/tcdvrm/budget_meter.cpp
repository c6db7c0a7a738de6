#include "tcdvrm/budget_meter.h"

#include <algorithm>
#include <limits>

namespace kairos {
namespace {

constexpr double kMemory = 0.95;       // of an observation after the next one
constexpr double kPriorWeight = 0.02;  // of the current proportions against what is observed
constexpr double kSmallest = 1e-3;     // ms; what takes less says nothing about speed

}  // namespace

void RunningMedian::add(double value) {
  last_ = value;
  values_[count_++ % kCount] = value;
  std::array<double, kCount> sorted = values_;
  const size_t known = std::min(count_, kCount);
  std::sort(sorted.begin(), sorted.begin() + long(known));
  median_ = sorted[known / 2];
}

void CostModel::learn(CastWork work, double ms) {
  if (ms < kSmallest || work.samples + work.segments <= 0) return;
  speed_.add(ms / linear(work));
  // Relative errors count: every observation is scaled to one millisecond, at the current speed.
  const double s = work.samples / ms, g = work.segments / ms, t = 1 / speed_.value();
  ss_ = kMemory * ss_ + s * s;
  sg_ = kMemory * sg_ + s * g;
  gg_ = kMemory * gg_ + g * g;
  st_ = kMemory * st_ + s * t;
  gt_ = kMemory * gt_ + g * t;
  solve();
}

// The least-squares proportions, drawn a little towards the current ones so that they stay defined when all
// observations are alike.
void CostModel::solve() {
  const double rs = kPriorWeight * ss_ + 1e-12, rg = kPriorWeight * gg_ + 1e-12;
  const double a = ss_ + rs, b = sg_, c = gg_ + rg;
  const double x = st_ + rs * perSample_, y = gt_ + rg * perSegment_;
  const double determinant = a * c - b * b;
  if (!(determinant > 0)) return;
  const double perSample = (x * c - y * b) / determinant, perSegment = (a * y - b * x) / determinant;
  if (perSample <= 0 || perSegment < 0) return;
  perSample_ = perSample;
  perSegment_ = perSegment;
}

BudgetMeter::BudgetMeter(const Budget& budget, BudgetClock* clock)
    : budget_(budget), clock_(clock ? *clock : steadyBudgetClock()) {}

void BudgetMeter::beginFrame() {
  begin_ = clock_.now();
  samples_ = 0;
}

double BudgetMeter::total() const {
  if (timed()) return budget_.milliseconds;
  return budget_.samples > 0 ? double(budget_.samples) : std::numeric_limits<double>::infinity();
}

double BudgetMeter::remaining() {
  return timed() ? budget_.milliseconds - elapsed() : total() - samples_;
}

void BudgetMeter::beginCasting() {
  castingBegin_ = clock_.now();
}

double BudgetMeter::endCasting(CastWork work, bool usual) {
  samples_ += work.samples;
  clock_.worked(uint64_t(work.samples), uint64_t(work.segments));
  const double ms = clock_.now() - castingBegin_;
  if (usual) model_.learn(work, ms);
  return ms;
}

}  // namespace kairos
