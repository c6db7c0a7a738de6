#include "tcdvrm/error_probe.h"

#include <algorithm>
#include <cmath>

namespace kairos {
namespace {

constexpr double kMostUnits = 0.08;  // of all units: 0.5 % of their pixels
constexpr double kFewestUnits = 32;  // where that is more
constexpr size_t kBiasEvery = 3;     // of the units drawn, those cast at every sample distance
constexpr double kBiasCost = 0.75;   // of the longer distances, to the exact one's
constexpr double kMemory = 0.75;     // of a frame's errors in the next one
constexpr double kSkew = 1.5;        // of the interval: what was missed are large errors, not small ones
constexpr double kDrift = 0.1;       // by how much errors move against the model within that memory
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
                          BudgetMeter& meter, double density) {
  const double cost = meter.cost(unitWork) * (1 + kBiasCost / double(kBiasEvery));
  const double wanted =
      std::min(std::max(kFewestUnits, kMostUnits * density * double(units.size())), double(units.size()));
  const double affordable = cost > 0 ? std::max(budget, 0.0) / cost : wanted;
  poolBefore_ = pool_;
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

// Sums over the last frames' units: of the squared errors seen and modelled, in units of what each frame's
// image was expected to have, and of the variance of the former.
void ErrorProbe::Pool::add(const Pool& frame) {
  const double m = kMemory;
  *this = {m * units + frame.units, m * seen + frame.seen, m * modelled + frame.modelled,
           m * m * variance + frame.variance};
}

ErrorProbe::Pool ErrorProbe::poolOf(std::span<const UnitError> errors, double total) const {
  Pool pool{double(errors.size()), 0, 0, 0};
  const double weight = pool.units / total;
  for (size_t i = 0; i < errors.size(); ++i) {
    pool.seen += weight * drawn_[i].represents * errors[i].seen;
    pool.modelled += weight * drawn_[i].represents * errors[i].modelled;
  }
  const double ratio = pool.modelled > 0 ? pool.seen / pool.modelled : 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    const double residual = weight * drawn_[i].represents * (errors[i].seen - ratio * errors[i].modelled);
    pool.variance += residual * residual;
  }
  pool.variance *= pool.units / (pool.units - 1);
  return pool;
}

// The interval is symmetric for the logarithm, since a mean of squares is skewed.
std::optional<ErrorEstimate> ErrorProbe::estimate(std::span<const UnitError> errors, double total,
                                                  double imageValues) {
  if (total <= 0) return std::nullopt;
  const Pool frame = poolOf(errors, total);
  if (frame.modelled <= 0 || frame.seen + poolBefore_.seen <= 0) return std::nullopt;
  pool_ = poolBefore_;
  if (!agrees(frame)) pool_ = {};
  pool_.add(frame);
  // Neighbouring frames have their rare large errors in the same places: together they tell no more about
  // those than one does, so the interval is that of one frame, with the deviation that all of them show.
  const double deviation =
      std::hypot(std::sqrt(pool_.variance * pool_.units / frame.units) / pool_.seen, kDrift);
  const double rmse = std::sqrt(total * pool_.seen / pool_.modelled / imageValues);
  const double half = studentQuantile(std::max(frame.units - 1, 1.0)) * deviation / 2;
  return ErrorEstimate{rmse, rmse * std::exp(-half), rmse * std::exp(kSkew * half)};
}

// Few units that saw little may only have missed the rare large errors, which is no reason to forget earlier
// frames; nor does their own spread tell how far off they may be.
bool ErrorProbe::agrees(const Pool& frame) const {
  if (pool_.seen <= 0 || frame.seen <= 0) return true;
  const double before = std::sqrt(pool_.variance) / pool_.seen;
  const double now =
      std::max(std::sqrt(frame.variance) / frame.seen, before * std::sqrt(pool_.units / frame.units));
  const double difference = std::log(frame.seen / frame.modelled) - std::log(pool_.seen / pool_.modelled);
  return std::abs(difference) < kAgreement * std::hypot(before, now);
}

}  // namespace kairos
