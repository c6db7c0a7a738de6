#include "tcdvrm/error_probe.h"

#include <algorithm>
#include <cmath>

namespace kairos {
namespace {

constexpr double kMostUnits = 0.08;  // of all units: 0.5 % of their pixels
constexpr double kFewestUnits = 32;  // where that is more
constexpr size_t kBiasEvery = 3;     // of the units drawn, those cast at every sample distance
constexpr double kBiasCost = 0.75;   // of the longer distances, to the exact one's
constexpr double kNewest = 0.4;      // weight of a frame's error against the ones before
constexpr double kAgreement = 2.5;   // deviations by which frames may differ and still agree
constexpr double kBiasMemory = 0.8;
constexpr size_t kFewestForBias = 8;

// 97.5 % quantile of Student's t, after Cornish and Fisher.
double studentQuantile(double degrees) {
  constexpr double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4 * degrees) + (5 * z5 + 16 * z3 + 3 * z) / (96 * degrees * degrees);
}

}  // namespace

ErrorProbe::ErrorProbe(const SceneState& scene, const StepLevels& levels, uint64_t seed)
    : scene_(scene), levels_(levels), random_(seed) {
  const RenderSettings& settings = scene.settings();
  unitsX_ = (settings.width + kUnitEdge - 1) / kUnitEdge;
  unitsY_ = (settings.height + kUnitEdge - 1) / kUnitEdge;
  for (int level = 0; level < StepLevels::kCount; ++level)
    for (int shift = 0; shift < 16; ++shift)
      shifted_[size_t(level)].emplace_back(
          levels[level].settings, scene.volume(), scene.pool(),
          RayLattice{4, 0.5 + (shift & 3), 0.5 + (shift >> 2), unitsX_ * kTileEdge, unitsY_ * kTileEdge},
          SegmentLists::walked);
}

void ErrorProbe::draw(std::span<const uint32_t> units, size_t count) {
  drawn_.clear();
  if (count < 2) return;
  for (size_t s = 0; s < count; ++s) {
    const size_t begin = s * units.size() / count, end = (s + 1) * units.size() / count;
    const uint64_t bits = random_();
    Drawn unit{};
    unit.unit = units[begin + (bits >> 8) % (end - begin)];
    unit.shiftX = int(bits & 3);
    unit.shiftY = int(bits >> 2 & 3);
    unit.represents = double(end - begin);
    drawn_.push_back(unit);
  }
}

void ErrorProbe::castUnit(Drawn& drawn, bool allLevels, PreparedTile& scratch) const {
  TileCounters counters;
  const auto castAt = [&](int level, PacketColours& colours) {
    castColours(shifted_[size_t(level)][size_t(drawn.shiftX + 4 * drawn.shiftY)], levels_[level].scene,
                levels_[level].kernel, int(drawn.unit), colours, scratch, counters);
  };
  castAt(0, drawn.exact);
  for (int level = 1; level < StepLevels::kCount && allLevels; ++level) {
    PacketColours coarse;
    castAt(level, coarse);
    drawn.bias[size_t(level)] = squaredDistance(coarse, drawn.exact);
  }
  drawn.work = {double(counters.samples), double(counters.segmentsIntegrated)};
}

CastWork ErrorProbe::cast(std::span<const uint32_t> units, CastWork unitWork, double budget,
                          BudgetMeter& meter) {
  const double cost = meter.cost(unitWork) * (1 + kBiasCost / double(kBiasEvery));
  const double wanted =
      std::min(std::max(kFewestUnits, kMostUnits * double(units.size())), double(units.size()));
  const double affordable = cost > 0 ? std::max(budget, 0.0) / cost : wanted;
  draw(units, size_t(std::min(affordable, wanted)));
  meter.beginCasting();
  scene_.pool().forEach(drawn_.size(), 2, [&](size_t begin, size_t end) {
    PreparedTile scratch;
    for (size_t s = begin; s < end; ++s) castUnit(drawn_[s], s % kBiasEvery == 0, scratch);
  });
  CastWork sum;
  for (const Drawn& unit : drawn_) sum += unit.work;
  meter.endCasting(sum);
  learnBias();
  return sum;
}

void ErrorProbe::learnBias() {
  if (drawn_.size() < kFewestForBias) return;
  for (size_t level = 1; level < stepBias_.size(); ++level) {
    double error = 0, rays = 0;
    for (size_t s = 0; s < drawn_.size(); s += kBiasEvery) {
      error += drawn_[s].bias[level];
      rays += kLanes;
    }
    const double memory = stepBias_[level] > 0 ? kBiasMemory : 0;
    stepBias_[level] = memory * stepBias_[level] + (1 - memory) * error / rays;
  }
}

// The interval is symmetric for the logarithm, since a mean of squares is skewed; a sample that missed the
// rare large errors shows too small a variance as well, so the usual one counts where it is larger.
std::optional<ErrorEstimate> ErrorProbe::estimate(std::span<const UnitError> errors, double total,
                                                  double imageValues) {
  double seen = 0, modelled = 0;
  for (size_t i = 0; i < drawn_.size(); ++i) {
    seen += drawn_[i].represents * errors[i].seen;
    modelled += drawn_[i].represents * errors[i].modelled;
  }
  if (seen <= 0 || modelled <= 0 || total <= 0) return std::nullopt;
  const double ratio = seen / modelled;
  double variance = 0;
  for (size_t i = 0; i < drawn_.size(); ++i) {
    const double residual = drawn_[i].represents * (errors[i].seen - ratio * errors[i].modelled);
    variance += residual * residual;
  }
  const double n = double(drawn_.size());
  const double deviation = std::sqrt(variance * n / (n - 1)) / seen, logRatio = std::log(ratio);
  const bool agrees =
      spread_ > 0 && std::abs(logRatio - logRatio_) < kAgreement * std::max(spread_, deviation);
  logRatio_ = agrees ? logRatio_ + kNewest * (logRatio - logRatio_) : logRatio;
  spread_ = agrees ? spread_ + kNewest * (deviation - spread_) : deviation;
  const double rmse = std::sqrt(total * std::exp(logRatio_) / imageValues);
  const double half = studentQuantile(n - 1) * std::max(spread_, deviation) / 2;
  return ErrorEstimate{rmse, rmse * std::exp(-half), rmse * std::exp(half)};
}

}  // namespace kairos
