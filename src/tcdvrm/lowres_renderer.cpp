#include "tcdvrm/lowres_renderer.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/stopwatch.h"
#include "tcdvrm/float4.h"
#include "tcdvrm/interpolatable.h"

namespace kairos {
namespace {

constexpr int kMostEighths = 32;        // a stride of 16 pixels
constexpr double kErrorShare = 0.07;    // of the budget, for the rays that measure the error
constexpr double kLateralExponent = 3;  // of the interpolation's squared error, in the stride
constexpr double kHysteresis = 1.1;
constexpr double kMargin = 0.95;  // of the budget; a uniform lattice cannot stop half-way

/// The four taps of one output position: the first tap's index and the weights (Keys 1981, a = -1/2).
struct Taps {
  int first;
  float weights[4];
};

std::vector<Taps> tapsOf(int outputs, double stride) {
  std::vector<Taps> taps(static_cast<size_t>(outputs));
  for (int x = 0; x < outputs; ++x) {
    const double at = (x + 0.5) / stride - 0.5;
    const double whole = std::floor(at), f = at - whole;
    taps[size_t(x)] = {int(whole) - 1,
                       {float(((-0.5 * f + 1) * f - 0.5) * f), float((1.5 * f - 2.5) * f * f + 1),
                        float(((-1.5 * f + 2) * f + 0.5) * f), float((0.5 * f - 0.5) * f * f)}};
  }
  return taps;
}

Float4 clampedColour(Float4 v) {
  const Float4 zero = {0, 0, 0, 0};
  v = v < zero ? zero : v;
  v[3] = std::min(v[3], 1.0f);
  return v;
}

}  // namespace

double LowresRenderer::Choice::stride() const {
  return std::exp2(eighths / 8.0);
}

LowresRenderer::LowresRenderer(const Lattice& lattice, const RenderSettings& settings,
                               const RendererOptions& options, std::optional<int> stepLevel)
    : FrameRenderer(lattice, interpolatable(settings), options),
      fixedLevel_(stepLevel),
      meter_(options.budget, options.clock),
      exact_(scene_, options, {.segments = false}, image_, nullptr),
      levels_(scene_),
      probe_(scene_, levels_, options.seed),
      shown_(settings.width, settings.height) {
  if (exact_.caster().index()) visibility_.emplace(exact_.caster(), scene_);
}

void LowresRenderer::renderWhole() {
  exact_.restart();
  levels_.restart();
  probe_.restart();
  if (visibility_) visibility_->restart();
  shown_ = visibleBlocks();
  meter_.beginCasting();
  exact_.cast(exact_.staleTiles(), statistics_);
  fullWork_ = {double(statistics_.samples), double(statistics_.segmentsRecast)};
  meter_.endCasting(fullWork_);
  statistics_.error = ErrorEstimate{};
  frameExact_ = true;
  probe_.cast(visibleUnits(), {}, 0, meter_);  // what longer sample distances do
  learnInterpolation();
}

// What interpolating the exact image from every fourth pixel of a row would miss half-way.
void LowresRenderer::learnInterpolation() {
  double sum = 0, count = 0;
  for (int y = 0; y < image_.height; y += 4)
    for (int x = 6; x + 6 < image_.width; x += 4) {
      const auto at = [&](int i) { return load4(image_.pixel(i, y)); };
      sum += double(
          squaredDistance(image_.pixel(x, y), cubicBetween(at(x - 6), at(x - 2), at(x + 2), at(x + 6))));
      ++count;
    }
  lateral_ = firstLateral_ = count > 0 ? sum / count : 0;
  lateralStride_ = 4;
}

CastWork LowresRenderer::workOf(const Choice& choice) const {
  const double rays = 1 / (choice.stride() * choice.stride());
  return {fullWork_.samples * rays / double(1 << choice.stepLevel), fullWork_.segments * rays};
}

double LowresRenderer::expectedError(const Choice& choice) const {
  if (choice.eighths == 0) return probe_.stepBias(choice.stepLevel);
  return probe_.stepBias(choice.stepLevel) +
         lateral_ * std::pow(choice.stride() / lateralStride_, kLateralExponent);
}

BlockSet LowresRenderer::visibleBlocks() const {
  if (visibility_) return visibility_->blocks();
  BlockSet all = shown_;
  for (size_t b = 0; b < all.size(); ++b) all.set(b, true);
  return all;
}

// All other units are blank, exactly.
std::vector<uint32_t> LowresRenderer::visibleUnits() const {
  const BlockSet visible = visibleBlocks();
  std::vector<uint32_t> units;
  constexpr int kBlocks = kUnitEdge / kBlockEdge;
  for (int unit = 0; unit < probe_.unitCount(); ++unit) {
    const int column = unit % probe_.unitsX() * kBlocks, row = unit / probe_.unitsX() * kBlocks;
    bool any = false;
    for (int r = row; r < std::min(row + kBlocks, visible.rows()); ++r)
      for (int c = column; c < std::min(column + kBlocks, visible.columns()); ++c)
        any |= visible.contains(c, r);
    if (any) units.push_back(uint32_t(unit));
  }
  return units;
}

// The densest lattice of each sample distance that fits, and the best of these. False when not even the
// coarsest does.
bool LowresRenderer::choose(double budget) {
  std::optional<Choice> best;
  double least = INFINITY;
  for (int level = 0; level < StepLevels::kCount; ++level) {
    if (fixedLevel_ && level != *fixedLevel_) continue;
    Choice choice{level, 0};
    while (choice.eighths < kMostEighths && meter_.cost(workOf(choice)) > budget) ++choice.eighths;
    if (meter_.cost(workOf(choice)) > budget) continue;
    const double error = expectedError(choice) * (level == choice_.stepLevel ? 1 : kHysteresis);
    if (best && error >= least) continue;
    least = error;
    best = choice;
  }
  choice_ = best.value_or(Choice{StepLevels::kCount - 1, kMostEighths});
  return best.has_value();
}

const TileCaster& LowresRenderer::casterOf(const Choice& choice) {
  std::unique_ptr<TileCaster>& caster = casters_[choice];
  if (!caster) {
    const double stride = choice.stride();
    const RayLattice rays{stride, stride / 2, stride / 2, int(std::ceil(image_.width / stride)),
                          int(std::ceil(image_.height / stride))};
    caster = std::make_unique<TileCaster>(levels_[choice.stepLevel].settings, scene_.volume(), pool_, rays);
  }
  return *caster;
}

void LowresRenderer::renderChanges(const ChangedVoxels&, const AppliedChanges& applied) {
  Stopwatch clock;
  exact_.note(applied);
  if (visibility_) visibility_->follow(applied);
  if (meter_.cost(fullWork_) <= kMargin * meter_.remaining()) {
    exact_.cast(exact_.staleTiles(), statistics_);
    fullWork_ = {double(statistics_.samples), double(statistics_.segmentsRecast)};
    statistics_.error = ErrorEstimate{};
    frameExact_ = true;
    return;
  }
  frameExact_ = false;
  const double budget = (meter_.remaining() - (meter_.timed() ? finishMs_ : 0)) * kMargin;
  const std::vector<uint32_t> units = visibleUnits();
  const CastWork probed = probe_.cast(units, fullWork_ * (1.0 / double(image_.data.size() / 4 / kLanes)),
                                      kErrorShare * budget, meter_);
  statistics_.budgetTooSmall = !choose(budget * (1 - kErrorShare));
  statistics_.selectMs = clock.lap();
  castCoarse();
  statistics_.samples += uint64_t(probed.samples);
  statistics_.raysCast += probe_.raysCast();
  statistics_.castMs = clock.lap();
  enlarge();
  measureError();
  const double finish = clock.lap();
  statistics_.composeMs = finish;
  finishMs_ = finishMs_ > 0 ? 0.7 * finishMs_ + 0.3 * finish : finish;
  statistics_.stepLevel = 1 << choice_.stepLevel;
}

void LowresRenderer::castCoarse() {
  const TileCaster& caster = casterOf(choice_);
  const ViewRays& view = caster.view();
  if (coarse_.width != view.width() || coarse_.height != view.height())
    coarse_ = Image(view.width(), view.height(), 4);
  TileCounters total;
  std::mutex totalMutex;
  meter_.beginCasting();
  pool_.forEach(size_t(view.tileCount()), 16, [&](size_t begin, size_t end) {
    TileCounters counters;
    PreparedTile scratch;
    PacketColours colours;
    for (size_t tile = begin; tile < end; ++tile) {
      castColours(caster, levels_[choice_.stepLevel].scene, levels_[choice_.stepLevel].kernel, int(tile),
                  colours, scratch, counters);
      for (int lane = 0; lane < kLanes; ++lane) {
        const int x = int(tile) % view.tilesX() * kTileEdge + lane % kTileEdge;
        const int y = int(tile) / view.tilesX() * kTileEdge + lane / kTileEdge;
        if (x < view.width() && y < view.height()) store4(coarse_.pixel(x, y), load4(colours.rgba[lane]));
      }
    }
    std::lock_guard lock(totalMutex);
    total += counters;
  });
  const CastWork work{double(total.samples), double(total.segmentsIntegrated)};
  meter_.endCasting(work);
  const double perRay = choice_.stride() * choice_.stride();
  fullWork_ = {work.samples * perRay * double(1 << choice_.stepLevel), work.segments * perRay};
  statistics_.samples += total.samples;
  statistics_.segmentsRecast += total.segmentsIntegrated;
  statistics_.raysCast += uint64_t(view.width()) * uint64_t(view.height());
}

// The smallest box of pixels outside of which the image is blank and stays so.
LowresRenderer::PixelBox LowresRenderer::shownBox() {
  const BlockSet visible = visibleBlocks();
  PixelBox box{image_.width, image_.height, 0, 0};
  for (size_t b = 0; b < visible.size(); ++b) {
    if (!visible.contains(b) && !shown_.contains(b)) continue;
    const int column = int(b) % visible.columns(), row = int(b) / visible.columns();
    box.left = std::min(box.left, column * kBlockEdge);
    box.right = std::max(box.right, std::min((column + 1) * kBlockEdge, image_.width));
    box.top = std::min(box.top, row * kBlockEdge);
    box.bottom = std::max(box.bottom, std::min((row + 1) * kBlockEdge, image_.height));
  }
  shown_ = visible;
  return box;
}

// Columns first, then rows.
void LowresRenderer::enlarge() {
  const PixelBox box = shownBox();
  if (box.left >= box.right) return;
  const std::vector<Taps> columns = tapsOf(image_.width, choice_.stride());
  const std::vector<Taps> rows = tapsOf(image_.height, choice_.stride());
  if (wide_.width != image_.width || wide_.height != coarse_.height)
    wide_ = Image(image_.width, coarse_.height, 4);
  const auto nearest = [](int i, int count) { return std::clamp(i, 0, count - 1); };
  const int top = nearest(rows[size_t(box.top)].first, coarse_.height);
  const int bottom = nearest(rows[size_t(box.bottom) - 1].first + 3, coarse_.height) + 1;
  pool_.forEach(size_t(bottom - top), 4, [&](size_t begin, size_t end) {
    for (size_t y = begin + size_t(top); y < end + size_t(top); ++y)
      for (int x = box.left; x < box.right; ++x) {
        const Taps& t = columns[size_t(x)];
        Float4 sum = {0, 0, 0, 0};
        for (int k = 0; k < 4; ++k)
          sum += t.weights[k] * load4(coarse_.pixel(nearest(t.first + k, coarse_.width), int(y)));
        store4(wide_.pixel(x, int(y)), sum);
      }
  });
  pool_.forEach(size_t(box.bottom - box.top), 8, [&](size_t begin, size_t end) {
    for (size_t y = begin + size_t(box.top); y < end + size_t(box.top); ++y) {
      const Taps& t = rows[y];
      const float* from[4];
      for (int k = 0; k < 4; ++k) from[k] = wide_.pixel(0, nearest(t.first + k, wide_.height));
      float* to = image_.pixel(0, int(y));
      for (int x = box.left * 4; x < box.right * 4; x += 4) {
        Float4 sum = t.weights[0] * load4(from[0] + x);
        for (int k = 1; k < 4; ++k) sum += t.weights[k] * load4(from[k] + x);
        store4(to + x, clampedColour(sum));
      }
    }
  });
}

void LowresRenderer::measureError() {
  // A model that does not learn, so that what the rays say of it can be smoothed over frames.
  const double expected = probe_.stepBias(choice_.stepLevel) +
                          firstLateral_ * std::pow(choice_.stride() / 4, kLateralExponent) + 1e-12;
  const double unitPixels = double(kUnitEdge) * kUnitEdge;
  statistics_.error = probe_.measure(
      image_, [&](uint32_t) { return expected * unitPixels; },
      expected * unitPixels * double(visibleUnits().size()), [](int, int) { return true; });
  probe_.give(
      image_, [](int, int) { return true; },
      [&](int x, int y, const float* rgba) { store4(image_.pixel(x, y), load4(rgba)); });
  if (!statistics_.error) return;
  const double measured = statistics_.error->rmse * statistics_.error->rmse * 4;
  const double bias = probe_.stepBias(choice_.stepLevel);
  lateral_ = std::max(measured - bias, 0.05 * measured);
  lateralStride_ = choice_.stride();
}

Image LowresRenderer::aov(Aov kind) const {
  Image values = FrameRenderer::aov(kind);
  if (frameExact_) return values;
  const double error = statistics_.error ? statistics_.error->rmse : 0;
  if (kind == Aov::error || kind == Aov::level)
    std::fill(values.data.begin(), values.data.end(), float(kind == Aov::error ? error : choice_.stride()));
  return values;
}

uint64_t LowresRenderer::memoryBytes() const {
  uint64_t bytes = scene_.volume().memoryBytes() + exact_.memoryBytes();
  for (const auto& [choice, caster] : casters_) bytes += caster->index() ? caster->index()->memoryBytes() : 0;
  return bytes;
}

}  // namespace kairos
