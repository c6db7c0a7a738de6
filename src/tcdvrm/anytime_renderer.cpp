#include "tcdvrm/anytime_renderer.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"
#include "tcdvrm/interpolatable.h"

namespace kairos {
namespace {

// Changes that reach so much of what is visible leave little to be found out about single rays.
constexpr double kMostly = 0.8;

// An exact frame is begun when it is expected to take at most so much of the budget.
constexpr double kExactShare = 0.92;
constexpr double kWorthRefining = 1.0 / 32;  // of the image's samples
// Scattered rays cost more than whole tiles: refinement that takes so much of the samples is left for a
// while.
constexpr double kNearlyAll = 0.6;
constexpr int kExactFrames = 8;
constexpr size_t kFewestTiles = 16;  // of a batch, where they fit

// What has to be left of the budget beside what the rest of an exact frame is expected to take: to refine
// that instead, should it turn out dearer.
constexpr double kKeptBack = 0.04;

// The first batch of a frame that is to become exact: small, since its cost is a guess until then.
constexpr double kFirstBatch = 0.05;  // of the budget
constexpr double kLearning = 0.7;     // of a new observation in the guess

}  // namespace

AnytimeRenderer::AnytimeRenderer(const Lattice& lattice, const RenderSettings& settings,
                                 const RendererOptions& options)
    : FrameRenderer(lattice, interpolatable(settings), options),
      untilGood_(options.budget.error > 0),
      meter_(options.budget, options.clock),
      exact_(scene_, options, {.pixels = true}, image_, nullptr),
      refinement_(scene_, exact_.caster(), image_, meter_, options),
      visibility_(withSegmentLists(exact_.caster()), scene_),
      shown_(settings.width, settings.height) {}

size_t AnytimeRenderer::blockOf(uint32_t tile) const {
  const auto tilesX = uint32_t(exact_.caster().view().tilesX());
  return shown_.index(int(tile % tilesX / 2), int(tile / tilesX / 2));
}

// Calls body(tile) for the tiles of a block.
template <class Body>
void AnytimeRenderer::forTiles(size_t block, Body&& body) const {
  const ViewRays& view = exact_.caster().view();
  const int x0 = int(block) % shown_.columns() * 2, y0 = int(block) / shown_.columns() * 2;
  for (int y = y0; y < std::min(y0 + 2, view.tilesY()); ++y)
    for (int x = x0; x < std::min(x0 + 2, view.tilesX()); ++x) body(uint32_t(y * view.tilesX() + x));
}

void AnytimeRenderer::renderWhole() {
  exact_.restart();
  unmarked_ = false;
  visibility_.restart();
  approximated_.assign(shown_.size(), 0);
  uint64_t latticeSamples = 0;
  for (uint32_t tile = 0; tile < uint32_t(exact_.tileCount()); ++tile)
    for (const Segment& s : exact_.caster().index()->segments(int(tile)))
      if (scene_.occupancy().visible(s.cell)) latticeSamples += uint64_t(s.kEnd - s.kBegin) * kLanes;
  meter_.beginCasting();
  exact_.cast(exact_.staleTiles(), statistics_);
  meter_.endCasting({double(statistics_.samples), double(statistics_.segmentsRecast)});
  if (latticeSamples > 0) {
    samplesPerLatticeSample_ = double(statistics_.samples) / double(latticeSamples);
    segmentsPerSample_ = double(statistics_.segmentsRecast) / std::max(1.0, double(statistics_.samples));
  }
  shown_ = visibility_.blocks();
  refinement_.restart();
  statistics_.error = ErrorEstimate{};
  statistics_.cacheBytes = exact_.cacheBytes();
}

void AnytimeRenderer::renderChanges(const ChangedVoxels&, const AppliedChanges& applied) {
  Stopwatch clock;
  exactFrames_ = std::max(0, exactFrames_ - 1);
  const BlockSet& touched = visibility_.follow(applied);
  // Where most bricks changed and exact rays are out of reach, which of them changed is left for later.
  const ExactImage::Reach reach = exact_.reachOf(applied);
  const bool mostly = double(reach.touched) >= kMostly * double(reach.visible);
  if (mostly && !fits(refinement_.exactWork(touched))) {
    exact_.note(applied);
    unmarked_ = true;
    statistics_.selectMs += clock.lap();
    refineUnmarked(touched);
    // Of all lattice samples, those that changes touch as far as blocks tell.
    const auto count = [](const BlockSet& blocks) { return double(std::max(blocks.count(), size_t(1))); };
    learnSamples(double(reach.visible) * count(touched) / count(shown_),
                 refinement_.exactWork(touched).samples);
  } else {
    if (unmarked_) exact_.mark();  // earlier steps' apart from this one's
    unmarked_ = false;
    exact_.note(applied);
    statistics_.segmentsDirty = exact_.mark();
    statistics_.selectMs += clock.lap();
    refineTouched();
  }
  statistics_.segmentsTotal = exact_.caster().index()->segmentCount();
  statistics_.cacheBytes = exact_.cacheBytes();
}

bool AnytimeRenderer::fits(CastWork exact) {
  if (untilGood_) return !worthRefining(exact);
  return meter_.cost(exact) <= kExactShare * meter_.remaining();
}

// Is there more to cast than what the fewest rays would take that refinement begins with, and did it lately
// take less than casting everything?
bool AnytimeRenderer::worthRefining(CastWork exact) const {
  return exactFrames_ == 0 && exact.samples > kWorthRefining * refinement_.exactWork(shown_).samples;
}

// All that shows anything may be inexact, since earlier changes were not followed to the rays.
void AnytimeRenderer::refineUnmarked(const BlockSet& touched) {
  const BlockSet visible = visibility_.blocks();
  BlockSet live = touched, uncertain = visible;
  for (size_t b = 0; b < live.size(); ++b) {
    const bool shows = visible.contains(b) || shown_.contains(b);
    if (shows && live.contains(b)) uncertain.set(b, true);
    if (!shows) live.set(b, false);
  }
  refine(live, uncertain);
  shown_ = visible;
}

// Exactly, if what this step touched fits the budget; else what is left of it is refined.
void AnytimeRenderer::refineTouched() {
  if (lastModelled_ < 0) lastModelled_ = modelledError();
  std::vector<uint32_t> touched;
  CastWork work;
  for (const uint32_t tile : exact_.staleTiles()) {
    shown_.set(blockOf(tile), true);
    if (!exact_.touched(tile)) continue;
    touched.push_back(tile);
    work += exactWork(tile);
  }
  const size_t done = fits(work) ? castExactly(touched, true) : 0;
  if (done == touched.size()) {
    payOwed();
    restoreExact();
    return reportOwed();
  }
  BlockSet live(image_.width, image_.height);
  for (size_t i = done; i < touched.size(); ++i) live.set(blockOf(touched[i]), true);
  BlockSet uncertain(image_.width, image_.height);
  for (const uint32_t tile : exact_.staleTiles()) uncertain.set(blockOf(tile), true);
  refine(live, uncertain);
  restoreExact();
}

void AnytimeRenderer::refine(const BlockSet& live, const BlockSet& uncertain) {
  for (size_t b = 0; b < live.size(); ++b)
    approximated_[b] |= uint8_t(live.contains(b) || (uncertain.contains(b) && refinement_.strideOf(b) > 1));
  refinement_.refine(live, uncertain, statistics_);
  if (untilGood_ && double(statistics_.samples) > kNearlyAll * refinement_.exactWork(live).samples)
    exactFrames_ = kExactFrames;
  if (!statistics_.error) {
    // What a budget too small left from an earlier step has an error that nobody has seen.
    if (!statistics_.budgetTooSmall) reportOwed();
    return;
  }
  lastMeasured_ = *statistics_.error;
  lastModelled_ = -1;  // found when a later frame asks for it
}

// Tiles that are exact but were refined together with their neighbours: their exact pixels once more.
void AnytimeRenderer::restoreExact() {
  std::vector<uint32_t> tiles;
  for (size_t b = 0; b < approximated_.size(); ++b) {
    if (!approximated_[b]) continue;
    approximated_[b] = 0;
    forTiles(b, [&](uint32_t tile) {
      if (exact_.stale(tile))
        approximated_[b] = 1;
      else
        tiles.push_back(tile);
    });
    if (!approximated_[b]) refinement_.takeExactBlock(b);
  }
  exact_.show(tiles);
  for (const uint32_t tile : tiles) refinement_.takeExactTile(int(tile));
}

CastWork AnytimeRenderer::exactWork(uint32_t tile) const {
  const double samples = double(exact_.latticeSamples(tile)) * samplesPerLatticeSample_;
  return {samples, samples * segmentsPerSample_};
}

// How many of the lattice's samples are taken: the others lie in windows that show nothing, or behind opaque
// ones.
void AnytimeRenderer::learnSamples(double latticeSamples, double samples) {
  if (latticeSamples > 0 && samples > 0)
    samplesPerLatticeSample_ = std::lerp(samplesPerLatticeSample_, samples / latticeSamples, kLearning);
}

// Casts tiles in their order, in batches of at most half of what is left of the budget. Returns how many: all
// that the budget allows or, where `whole`, none further once it turns out that not all will fit.
size_t AnytimeRenderer::castExactly(std::span<const uint32_t> tiles, bool whole) {
  size_t done = 0;
  while (done < tiles.size()) {
    const double left = meter_.remaining();
    const double share = whole && done == 0 ? kFirstBatch : 0.5;
    size_t end = done;
    CastWork expected;
    for (double cost = 0; end < tiles.size(); ++end) {
      const CastWork work = exactWork(tiles[end]);
      cost += meter_.cost(work);
      if (cost > left || (cost > left * share && end >= done + kFewestTiles)) break;
      expected += work;
    }
    if (end == done) break;
    const double latticeSamples = expected.samples / std::max(samplesPerLatticeSample_, 1e-9);
    const auto batch = tiles.subspan(done, end - done);
    const FrameStatistics before = statistics_;
    meter_.beginCasting();
    exact_.cast(batch, statistics_);
    meter_.endCasting({double(statistics_.samples - before.samples),
                       double(statistics_.segmentsRecast - before.segmentsRecast)});
    learnSamples(latticeSamples, double(statistics_.samples - before.samples));
    for (const uint32_t tile : batch) refinement_.takeExactTile(int(tile));
    done = end;
    if (!whole) continue;
    CastWork rest;
    for (const uint32_t tile : tiles.subspan(done)) rest += exactWork(tile);
    if (done < tiles.size() && meter_.cost(rest) > meter_.remaining() - kKeptBack * meter_.total()) break;
  }
  return done;
}

// What an earlier frame refined instead of casting it exactly, the worst first.
void AnytimeRenderer::payOwed() {
  if (untilGood_) return;
  BlockQueue<uint32_t> queue;
  for (const uint32_t tile : exact_.staleTiles()) {
    const double cost = std::max(meter_.cost(exactWork(tile)), 1e-9);
    queue.push(float(refinement_.expectedError(blockOf(tile)) / cost), tile);
  }
  std::vector<uint32_t> tiles;
  while (!queue.empty()) tiles.push_back(queue.pop());
  castExactly(tiles, false);
}

double AnytimeRenderer::modelledError() const {
  double sum = 0;
  for (size_t b = 0; b < shown_.size(); ++b) {
    if (!visibility_.visible(b)) continue;
    forTiles(b, [&](uint32_t tile) {
      if (unmarked_ || exact_.stale(tile)) sum += refinement_.expectedError(b) * kLanes;
    });
  }
  return sum;
}

// Without rays drawn in this frame: the last measured error, changed as the model says.
void AnytimeRenderer::reportOwed() {
  if (!unmarked_ && exact_.staleTiles().empty()) {
    statistics_.error = ErrorEstimate{};
    return;
  }
  if (lastModelled_ <= 0) return;
  const double factor = std::sqrt(modelledError() / lastModelled_);
  statistics_.error =
      ErrorEstimate{lastMeasured_.rmse * factor, lastMeasured_.low * factor, lastMeasured_.high * factor};
}

Image AnytimeRenderer::aov(Aov kind) const {
  Image values(image_.width, image_.height, 1);
  const int tilesX = exact_.caster().view().tilesX();
  for (int y = 0; y < values.height; ++y)
    for (int x = 0; x < values.width; ++x) {
      const auto tile = uint32_t(y / kTileEdge * tilesX + x / kTileEdge);
      const bool exact = !unmarked_ && !exact_.stale(tile);
      const size_t block = blockOf(tile);
      const bool blank = !visibility_.visible(block);
      float& value = *values.pixel(x, y);
      if (kind == Aov::error)
        value = exact || blank ? 0 : float(std::sqrt(refinement_.expectedError(block) / 4));
      else if (kind == Aov::level)
        value = exact || blank ? 1 : float(std::min(refinement_.strideOf(block), 16));
      else if (kind == Aov::age)
        value = exact || blank ? 0 : float(refinement_.age(x, y));
    }
  return values;
}

uint64_t AnytimeRenderer::memoryBytes() const {
  return scene_.volume().memoryBytes() + exact_.memoryBytes() + refinement_.memoryBytes();
}

}  // namespace kairos
