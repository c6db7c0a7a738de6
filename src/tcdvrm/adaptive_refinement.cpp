#include "tcdvrm/adaptive_refinement.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "raycast/morton.h"

namespace kairos {
namespace {

constexpr double kErrorShare = 0.08;    // of the budget, for the rays that measure the error
constexpr double kBlendShare = 0.1;     // of the time for rays, for keeping what blending needs
constexpr double kLatticeShare = 0.85;  // of the budget, for the lattice to start from: it must not break off
constexpr double kHysteresis = 1.1;
constexpr double kBiasShare =
    0.15;                        // of the squared error a goal allows, for that of a longer sample distance
constexpr double kWideWork = 2;  // of a packet of stride 8, to what its samples let expect
constexpr double kSegmentSamples = 20;  // what a packet's segment takes, in samples
constexpr double kSmallestBatchMs = 0.1, kSmallestBatchPackets = 16;
constexpr double kReserveMargin = 1.1, kReserveMs = 0.02;

}  // namespace

AdaptiveRefinement::AdaptiveRefinement(const SceneState& scene, const TileCaster& exactTiles, Image& image,
                                       BudgetMeter& meter, const RendererOptions& options)
    : scene_(scene),
      exactTiles_(exactTiles),
      image_(image),
      meter_(meter),
      levels_(scene),
      rays_(scene, levels_),
      probe_(scene, levels_, options.seed),
      pyramid_(image, scene.pool()),
      blend_(image.width, image.height),
      mayBlend_(options.blend),
      live_(image.width, image.height),
      uncertain_(live_),
      added_(live_) {
  if (options.budget.error > 0) goal_.emplace(options.budget.error, double(image.data.size()));
  const ViewRays& units = rays_.view(RefinementRays::stride4);
  unitOrder_ = mortonOrder(units.tilesX(), units.tilesY());
  const size_t blocks = BlockSet(image.width, image.height).size();
  error4_.assign(blocks, 0);
  error2_.assign(blocks, 0);
  stride_.assign(blocks, 1);
  error8_.assign(blocks, 0);
  fineAt_.assign(blocks, 0);
  unitWork_.resize(unitOrder_.size());
  unitGain_.assign(unitOrder_.size(), 0);
  unitError_.assign(unitOrder_.size(), 0);
  const BlockSet all(image.width, image.height);
  for (int row = 0; row < all.rows(); ++row)
    for (int column = 0; column < all.columns(); ++column)
      unitOf_.push_back(uint32_t(row / kUnitBlocks * units.tilesX() + column / kUnitBlocks));
  lastCast_.assign(size_t(image.width) * size_t(image.height), 0);
}

// ---- Learning from an exact image ----

void AdaptiveRefinement::restart() {
  levels_.restart();
  probe_.restart();
  pyramid_.takeImage();
  blend_ = DetailBlend(image_.width, image_.height);
  detailAge_ = {};
  for (auto& found : detailFoundIn_) found.assign(stride_.size(), frame_);
  std::fill(stride_.begin(), stride_.end(), uint8_t(1));
  std::fill(lastCast_.begin(), lastCast_.end(), frame_);
  learnInterpolation();
  learnSampling();
  lateralScale_ = 1;
}

// What interpolating this image from every fourth and every second pixel would miss.
void AdaptiveRefinement::learnInterpolation() {
  const NodeGrid &half = pyramid_.grid(1), &full = pyramid_.grid(0);
  const BlockSet blocks(image_.width, image_.height);
  const auto residual = [](const NodeGrid& grid, int i, int j) {
    if (i >= grid.columns || j >= grid.rows) return 0.0f;
    const Float4 cubic =
        i & 1 ? ColourPyramid::cubicAlongRow(grid, i, j, 1) : ColourPyramid::cubicAlongColumn(grid, i, j, 1);
    return squaredDistance(grid.node(i, j), cubic);
  };
  double sum8 = 0, sum4 = 0, sum2 = 0;
  for (int row = 0; row < blocks.rows(); ++row)
    for (int column = 0; column < blocks.columns(); ++column) {
      const size_t b = blocks.index(column, row);
      float e4 = 0, e2 = 0;
      for (int n = 0; n < 4; n += 2) {
        e4 +=
            residual(half, 4 * column + n + 1, 4 * row + n) + residual(half, 4 * column + n, 4 * row + n + 1);
        e2 += residual(full, 8 * column + 2 * n + 1, 8 * row + 2 * n) +
              residual(full, 8 * column + 2 * n, 8 * row + 2 * n + 1);
      }
      error4_[b] = e4 / 4;
      error2_[b] = e2 / 4;
      sum4 += error4_[b];
      sum2 += error2_[b];
      error8_[b] = latticeResidual(column, row);
      sum8 += error8_[b];
    }
  if (sum4 > 0) ratio2_ = std::clamp(sum2 / sum4, 0.002, 1.0);
  if (sum8 > 0) ratio4_ = std::clamp(sum4 / sum8, 0.002, 1.0);
}

// The squared residual of a block's nodes of stride 4 that lie between two of stride 8.
float AdaptiveRefinement::latticeResidual(int column, int row) const {
  const NodeGrid& grid = pyramid_.grid(2);
  const int i = 2 * column, j = 2 * row;
  float sum = 0;
  if (i + 1 < grid.columns)
    sum += squaredDistance(grid.node(i + 1, j), ColourPyramid::cubicAlongRow(grid, i + 1, j, 1));
  if (j + 1 < grid.rows)
    sum += squaredDistance(grid.node(i, j + 1), ColourPyramid::cubicAlongColumn(grid, i, j + 1, 1));
  return sum / 2;
}

// What a packet of each unit costs, and what longer sample distances do to the colours.
void AdaptiveRefinement::learnSampling() {
  std::vector<PacketColours> exact;
  for (int level = 0; level < StepLevels::kCount; ++level) {
    packets_.clear();
    for (const uint32_t unit : unitOrder_) packets_.push_back({RefinementRays::stride4, int(unit), unit});
    stepLevel_ = level;
    castBatch(packets_);
    if (level == 0) {
      exact = colours_;
      for (size_t p = 0; p < packets_.size(); ++p) unitWork_[packets_[p].owner] = works_[p];
      continue;
    }
    double sum = 0, rays = 0;
    for (size_t p = 0; p < packets_.size(); ++p) {
      if (unitWork_[packets_[p].owner].samples <= 0) continue;
      sum += squaredDistance(colours_[p], exact[p]);
      rays += kLanes;
    }
    probe_.setStepBias(level, rays > 0 ? sum / rays : 0);
  }
  packets_.clear();
  for (int tile = 0; tile < rays_.view(RefinementRays::stride8).tileCount(); ++tile)
    packets_.push_back({RefinementRays::stride8, tile, 0});
  stepLevel_ = 0;
  castBatch(packets_);
}

// ---- Planning ----

CastWork AdaptiveRefinement::workOf(uint32_t unit, int stepLevel) const {
  const CastWork& work = unitWork_[unit];
  return {work.samples / double(1 << stepLevel), work.segments};
}

// What work takes, to weigh gains against. Rays cost something even where samples alone are limited and a ray
// has none.
double AdaptiveRefinement::effort(CastWork work) const {
  return std::max(meter_.timed() ? meter_.cost(work) : work.samples + kSegmentSamples * work.segments, 1e-12);
}

double AdaptiveRefinement::wideCost() const {
  return meter_.timed() ? wideCost_ : 1;
}

double AdaptiveRefinement::castingBudget() {
  return meter_.remaining() - reserve_;
}

// A batch is at most half of what is left, so that a machine that turns twice as slow is noticed in time; the
// last one takes it all.
double AdaptiveRefinement::batchBudget() {
  const double left = castingBudget();
  const double smallest =
      meter_.timed() ? kSmallestBatchMs : kSmallestBatchPackets * meter_.cost(workOf(stepLevel_));
  const double safe = meter_.safely(left);
  return std::max(safe / 2, std::min(safe, smallest));
}

void AdaptiveRefinement::refine(const BlockSet& live, const BlockSet& uncertain,
                                FrameStatistics& statistics) {
  beginFrame(live, uncertain);
  if (goal_) goal_->beginFrame();
  choosePlan();
  keepOld();
  const double selected = meter_.elapsed();
  total_ += probe_.cast(uncertainUnits_, workOf(0), kErrorShare * castingBudget(), meter_,
                        goal_ ? ErrorGoal::kProbeDensity : 1);
  raysCast_ += probe_.raysCast();
  castLattice();
  pyramid_.interpolate(1, runs_, blending_ ? &blend_ : nullptr);
  queueBlocks();
  queueOwed();
  double cast, assembled;
  do {
    refineBlocks();
    cast = meter_.elapsed();
    assemble();
    assembled_ = true;
    measureError(statistics);
    assembled = meter_.elapsed();
  } while (goal_ && !queue_.empty() && !goal_->reached(statistics.error, expectedTotal()));
  probe_.give(
      image_, [&](int x, int y) { return mayBeWrong(x, y); },
      [&](int x, int y, const float* rgba) { writePixel(x, y, rgba); });
  if (liveBlocks_ > 0) finishMsPerBlock_.add((assembled - cast) / double(liveBlocks_));
  topUp();
  const double topped = meter_.elapsed();
  learn(statistics);
  statistics.selectMs += selected - begun_;
  statistics.castMs += cast - selected + meter_.elapsed() - assembled;
  statistics.composeMs += assembled - cast;
  report(statistics);
  tailMs_.add(meter_.elapsed() - topped);
}

// Blending is left out where what it needs would take much of the time for rays.
void AdaptiveRefinement::keepOld() {
  blending_ = mayBlend_ && !goal_ && blend_.worthwhile() &&
              (!meter_.timed() || keepMs_.value() <= kBlendShare * (castingBudget() + keepMs_.value()));
  if (!blending_) return;
  const double begin = meter_.elapsed();
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column) {
      const size_t b = live_.index(column, run.row);
      for (int level = 0; level < DetailBlend::kLevels; ++level)
        blend_.setFresh(level, b, detailAge(level, b) <= DetailAge::kOldest);
    }
  pyramid_.keepOld(runs_);
  keepMs_.add(meter_.elapsed() - begin);
}

void AdaptiveRefinement::beginFrame(const BlockSet& live, const BlockSet& uncertain) {
  begun_ = meter_.elapsed();
  ++frame_;
  live_ = live;
  uncertain_ = uncertain;
  // What is not even on the usual lattice yet joins in.
  for (size_t b = 0; b < live_.size(); ++b)
    if (uncertain.contains(b) && stride_[b] > 4) live_.set(b, true);
  added_.clear();
  runs_ = live_.runs();
  blend_.beginFrame();
  queue_.clear();
  fine_.clear();
  total_ = {};
  raysCast_ = 0;
  seen_ = {};
  tooSmall_ = assembled_ = false;
  units_.clear();
  uncertainUnits_.clear();
  liveBlocks_ = 0;
  std::vector<uint8_t> holdsLive(unitWork_.size(), 0), holdsUncertain(unitWork_.size(), 0);
  for (size_t b = 0; b < live_.size(); ++b) {
    if (live_.contains(b)) {
      holdsLive[unitOf_[b]] = 1;
      ++liveBlocks_;
    }
    if (uncertain.contains(b)) holdsUncertain[unitOf_[b]] = 1;
  }
  CastWork sum;
  for (const uint32_t unit : unitOrder_) {
    if (holdsUncertain[unit]) uncertainUnits_.push_back(unit);
    if (!holdsLive[unit]) continue;
    units_.push_back(unit);
    sum += unitWork_[unit];
  }
  meanWork_ = units_.empty() ? CastWork{} : sum * (1.0 / double(units_.size()));
  reserve_ =
      meter_.timed() ? kReserveMargin * finishMsPerBlock_.value() * double(liveBlocks_) + kReserveMs : 0;
}

CastWork AdaptiveRefinement::workOf(int stepLevel) const {
  return {meanWork_.samples / double(1 << stepLevel), meanWork_.segments};
}

// The errors and what refining takes of them, sorted by what it brings for a packet: greedy spending of any
// number of packets can be read off.
AdaptiveRefinement::ErrorCurve AdaptiveRefinement::errorCurve(int baseStride) const {
  ErrorCurve curve;
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column) {
      const size_t b = live_.index(column, run.row);
      const double e4 = error4(b), e2 = std::min(error2(b), e4);
      curve.total += baseStride == 4 ? e4 : std::max(double(error8_[b]), e4);
      if (e2 / 3 > e4 - e2) {
        curve.add(e4, 4);
      } else {
        curve.add(e4 - e2, 1);
        curve.add(e2, 3);
      }
    }
  if (baseStride == 8)
    for (const uint32_t unit : units_) curve.add(unitGain_[unit], 1);
  return curve;
}

void AdaptiveRefinement::ErrorCurve::add(double gain, double packets) {
  if (gain <= 0) return;
  Bucket& bucket = buckets[bucketOf(gain / packets)];
  bucket.gain += gain;
  bucket.packets += packets;
}

double AdaptiveRefinement::ErrorCurve::after(double packets) const {
  double error = total;
  for (auto bucket = buckets.rbegin(); bucket != buckets.rend() && packets > 0; ++bucket) {
    if (bucket->packets <= 0) continue;
    error -= bucket->gain * std::min(1.0, packets / bucket->packets);
    packets -= bucket->packets;
  }
  return std::max(error, 0.0);
}

double AdaptiveRefinement::ErrorCurve::packetsTo(double error) const {
  double left = total - error, packets = 0;
  for (auto bucket = buckets.rbegin(); bucket != buckets.rend() && left > 0; ++bucket) {
    if (bucket->gain <= 0) continue;
    packets += bucket->packets * std::min(1.0, left / bucket->gain);
    left -= bucket->gain;
  }
  return packets;
}

// Of the sample distances and lattices whose own error leaves room for some of interpolation, the pair that
// reaches the goal with the least work.
void AdaptiveRefinement::choosePlanForGoal() {
  const std::pair<int, ErrorCurve> curves[] = {{4, errorCurve(4)}, {8, errorCurve(8)}};
  double owed = 0;  // by blocks that stay as they are
  for (size_t b = 0; b < uncertain_.size(); ++b)
    if (uncertain_.contains(b) && !live_.contains(b)) owed += modelledError(b);
  double least = INFINITY;
  for (int level = 0; level < StepLevels::kCount; ++level)
    for (const auto& [stride, curve] : curves) {
      const double bias = probe_.stepBias(level) * double(uncertain_.count()) * kBlockPixels;
      if (bias > kBiasShare * goal_->allowed()) continue;
      const double lateral = (goal_->allowed() - bias) / (kBlockPixels * lateralScale_) - owed;
      const double packets =
          double(units_.size()) * (stride == 4 ? 1 : kWideWork / 4) + curve.packetsTo(lateral);
      const double cost = packets * effort(workOf(level)) * (level == stepLevel_ ? 1 : kHysteresis);
      if (cost >= least) continue;
      least = cost;
      plan_ = {level, stride};
    }
  stepLevel_ = plan_.stepLevel;
}

// Squared errors of all uncertain pixels together.
double AdaptiveRefinement::expectedTotal() const {
  double total = 0;
  for (size_t b = 0; b < uncertain_.size(); ++b)
    if (uncertain_.contains(b)) total += expectedError(b);
  return total * kBlockPixels;
}

double AdaptiveRefinement::gainOf(const Item& item) const {
  const double gain = item.stride == 4   ? unitGain_[item.block]
                      : item.stride == 2 ? error4(item.block) - error2(item.block)
                                         : error2(item.block);
  return std::max(gain, 0.0) * lateralScale_ * kBlockPixels;
}

// The sample distance and the lattice to start from whose own error and interpolation error together are
// least.
void AdaptiveRefinement::choosePlan() {
  findUnitGains();
  if (goal_) return choosePlanForGoal();
  const ErrorCurve from4 = errorCurve(4), from8 = errorCurve(8);
  const double budget = castingBudget() * (1 - kErrorShare);
  Plan best{StepLevels::kCount - 1, 16};
  double least = INFINITY;
  for (int level = 0; level < StepLevels::kCount; ++level)
    for (const int stride : {4, 8}) {
      const double packet = std::max(meter_.cost(workOf(level)), 1e-12);
      const double lattice = double(units_.size()) * (stride == 4 ? 1 : wideCost() / 4);
      const double packets = budget / packet - lattice;
      if (lattice * packet > kLatticeShare * budget) continue;
      // A coarser lattice is for what the usual one does not fit: its wide packets cost more than they save.
      if (stride == 8 && kLatticeShare * budget > packet * double(units_.size())) continue;
      const double lateral = (stride == 4 ? from4 : from8).after(packets);
      double error = probe_.stepBias(level) * double(liveBlocks_) + lateralScale_ * lateral;
      if (level != stepLevel_) error *= kHysteresis;
      if (error >= least) continue;
      least = error;
      best = {level, stride};
    }
  plan_ = best;
  stepLevel_ = best.stepLevel;
}

void AdaptiveRefinement::findUnitGains() {
  for (const uint32_t unit : units_) unitGain_[unit] = 0;
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column) {
      const size_t b = live_.index(column, run.row);
      unitGain_[unitOf_[b]] += std::max(0.0, double(error8_[b]) - double(error4_[b]));
    }
}

// What this frame showed about how errors follow from one another.
void AdaptiveRefinement::learn(const FrameStatistics& statistics) {
  for (DetailAge& level : detailAge_) level.endFrame();
  if (plan_.stride == 8 && seen_.expected8 > 0)
    ratio8_ = std::clamp(std::lerp(ratio8_, ratio8_ * seen_.error8 / seen_.expected8, 0.5), 0.002, 1.0);
  if (seen_.expected4 > 0)
    ratio4_ = std::clamp(std::lerp(ratio4_, ratio4_ * seen_.error4 / seen_.expected4, 0.5), 0.002, 1.0);
  if (seen_.expected2 > 0)
    ratio2_ = std::clamp(std::lerp(ratio2_, seen_.error2 / seen_.expected2, 0.5), 0.002, 1.0);
  if (!statistics.error) return;
  double lateral = 0, pixels = 0;
  for (size_t b = 0; b < uncertain_.size(); ++b)
    if (uncertain_.contains(b)) {
      lateral += modelledError(b) * kBlockPixels;
      pixels += kBlockPixels;
    }
  if (lateral <= 0) return;
  const double bias = probe_.stepBias(stepLevel_) * pixels;
  const double measured = std::max(measuredError_ - bias, 0.05 * measuredError_);
  lateralScale_ = std::clamp(std::lerp(lateralScale_, measured / lateral, 0.3), 0.05, 20.0);
}

// Expected when interpolated from stride 4, with what share of the old detail there is.
double AdaptiveRefinement::error4(size_t block) const {
  return double(error4_[block]) * (blending_ ? detailAge_[1].ratio(detailAge(1, block)) : 1);
}

double AdaptiveRefinement::error2(size_t block) const {
  return double(error2_[block]) * (blending_ ? detailAge_[0].ratio(detailAge(0, block)) : 1);
}

double AdaptiveRefinement::modelledError(size_t block) const {
  switch (stride_[block]) {
    case 1:
      return 0;
    case 2:
      return error2(block);
    case 4:
      return error4(block);
    default:
      return std::max(error8_[block], error4_[block]);
  }
}

CastWork AdaptiveRefinement::exactWork(const BlockSet& blocks) const {
  CastWork work;
  for (size_t b = 0; b < blocks.size(); ++b)
    if (blocks.contains(b)) work += unitWork_[unitOf_[b]];
  return work * (kBlockPixels / kLanes);
}

void AdaptiveRefinement::takeExactTile(int tile) {
  const int tilesX = exactTiles_.view().tilesX();
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = tile % tilesX * kTileEdge + lane % kTileEdge,
              y = tile / tilesX * kTileEdge + lane / kTileEdge;
    if (x >= image_.width || y >= image_.height) continue;
    pyramid_.takePixel(x, y);
    markCast(x, y);
  }
}

void AdaptiveRefinement::report(FrameStatistics& statistics) const {
  statistics.samples += uint64_t(total_.samples);
  statistics.segmentsRecast += uint64_t(total_.segments);
  statistics.raysCast += raysCast_;
  statistics.stepLevel = 1 << stepLevel_;
  statistics.budgetTooSmall = tooSmall_;
}

uint64_t AdaptiveRefinement::memoryBytes() const {
  return rays_.memoryBytes() + image_.data.size() * sizeof(float) / 3 + lastCast_.size() * sizeof(uint32_t);
}

}  // namespace kairos
