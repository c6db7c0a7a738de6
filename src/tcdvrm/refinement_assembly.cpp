// AdaptiveRefinement: from what was cast to the image, its measured error, and what time is left after that.
#include <algorithm>

#include "tcdvrm/adaptive_refinement.h"

namespace kairos {
namespace {

constexpr int kTilesPerBlock = 4;
constexpr size_t kFewestTiles = 4;  // of a batch, where they fit
constexpr double kEarly =
    0.005;  // of the budget: frames that end late do so by more than those that end early

}  // namespace

// From the nodes of stride 2 and the blocks that are cast whole to the image.
void AdaptiveRefinement::assemble() {
  assemble(runs_, blending_ ? &blend_ : nullptr);
  assemble(added_.runs(), nullptr);
}

void AdaptiveRefinement::assemble(std::span<const BlockRun> runs, const DetailBlend* blend) {
  BlockSet interpolated(image_.width, image_.height);
  std::vector<uint32_t> whole;
  for (const BlockRun& run : runs)
    for (int column = run.first; column < run.last; ++column) {
      const size_t b = live_.index(column, run.row);
      if (stride_[b] == 1)
        whole.push_back(uint32_t(b));
      else
        interpolated.set(b, true);
    }
  scene_.pool().forEach(whole.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) writeBlock(whole[i]);
  });
  pyramid_.interpolate(0, interpolated.runs(), blend);
}

void AdaptiveRefinement::writeBlock(uint32_t block) {
  pyramid_.takeFinePixels(block);
  const NodeGrid &half = pyramid_.grid(1), &full = pyramid_.grid(0);
  const int i0 = int(block) % live_.columns() * kTileEdge, j0 = int(block) / live_.columns() * kTileEdge;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int i = i0 + lane % kTileEdge, j = j0 + lane / kTileEdge;
    if (i >= half.columns || j >= half.rows) continue;
    store4(full.node(2 * i, 2 * j), load4(half.node(i, j)));
    for (int phase = 1; phase < 4; ++phase) {
      const int x = 2 * i + (phase & 1), y = 2 * j + (phase >> 1);
      if (x >= full.columns || y >= full.rows) continue;
      store4(full.node(x, y), load4(fine_[fineAt_[block] + uint32_t(phase) - 1].rgba[lane]));
      markCast(x, y);
    }
  }
}

void AdaptiveRefinement::measureError(FrameStatistics& statistics) {
  double total = 0;
  std::vector<double>& units = unitError_;
  for (const uint32_t unit : uncertainUnits_) units[unit] = 0;
  for (size_t b = 0; b < uncertain_.size(); ++b) {
    if (!uncertain_.contains(b)) continue;
    const double error =
        (modelledError(b) + probe_.stepBias(stepLevel_) + double(kLeastError)) * kBlockPixels;
    units[unitOf_[b]] += error;
    total += error;
  }
  statistics.error = probe_.measure(
      image_, [&](uint32_t unit) { return units[unit]; }, total,
      [&](int x, int y) { return mayBeWrong(x, y); });
  if (!statistics.error) return;
  measuredError_ = statistics.error->rmse * statistics.error->rmse * double(image_.data.size());
}

void AdaptiveRefinement::writePixel(int x, int y, const float* rgba) {
  store4(image_.pixel(x, y), load4(rgba));
  pyramid_.takePixel(x, y);
  markCast(x, y);
}

// What is left of the time after all is assembled goes into whole tiles, the worst blocks' first.
void AdaptiveRefinement::topUp() {
  reserve_ = 0;
  if (!meter_.timed()) return;
  std::vector<uint32_t> waiting, batch;
  do {
    const double left = meter_.remaining() - tailMs_.value() - kEarly * meter_.total();
    const double safe = meter_.safely(left);
    batch.clear();
    for (double cost = 0;;) {
      if (waiting.empty() && !takeWholeBlocks(waiting)) break;
      cost += meter_.cost(workOf(unitOf_[blockOfTile(waiting.back())], 0));
      if (cost > (batch.size() < kFewestTiles ? safe : safe / 2)) break;
      batch.push_back(waiting.back());
      waiting.pop_back();
    }
    castTiles(batch);
  } while (!batch.empty());
}

// The tiles of the next item of the queue. False when there is none.
bool AdaptiveRefinement::takeWholeBlocks(std::vector<uint32_t>& tiles) {
  while (tiles.empty() && !queue_.empty()) {
    const Item item = queue_.pop();
    if (item.stride != 4) {
      appendTiles(item.block, tiles);
      continue;
    }
    for (const uint32_t block : liveBlocksOf(item.block)) appendTiles(block, tiles);
  }
  return !tiles.empty();
}

size_t AdaptiveRefinement::blockOfTile(uint32_t tile) const {
  const auto tilesX = uint32_t(exactTiles_.view().tilesX());
  return live_.index(int(tile % tilesX / 2), int(tile / tilesX / 2));
}

void AdaptiveRefinement::appendTiles(uint32_t block, std::vector<uint32_t>& tiles) {
  const ViewRays& view = exactTiles_.view();
  for (int tile = 0; tile < kTilesPerBlock; ++tile) {
    const int x = int(block) % live_.columns() * 2 + (tile & 1);
    const int y = int(block) / live_.columns() * 2 + (tile >> 1);
    if (x < view.tilesX() && y < view.tilesY()) tiles.push_back(uint32_t(y * view.tilesX() + x));
  }
  stride_[block] = 1;
}

void AdaptiveRefinement::castTiles(std::span<const uint32_t> tiles) {
  if (tiles.empty()) return;
  colours_.resize(tiles.size());
  works_.resize(tiles.size());
  meter_.beginCasting();
  scene_.pool().forEach(tiles.size(), 2, [&](size_t begin, size_t end) {
    PreparedTile scratch;
    for (size_t t = begin; t < end; ++t) {
      TileCounters counters;
      castColours(exactTiles_, scene_.kernelScene(), scene_.kernel(), int(tiles[t]), colours_[t], scratch,
                  counters);
      works_[t] = {double(counters.samples), double(counters.segmentsIntegrated)};
    }
  });
  const int tilesX = exactTiles_.view().tilesX();
  for (size_t t = 0; t < tiles.size(); ++t)
    for (int lane = 0; lane < kLanes; ++lane) {
      const int x = int(tiles[t]) % tilesX * kTileEdge + lane % kTileEdge;
      const int y = int(tiles[t]) / tilesX * kTileEdge + lane / kTileEdge;
      if (x < image_.width && y < image_.height) writePixel(x, y, colours_[t].rgba[lane]);
    }
  charge(tiles.size(), false);
}

}  // namespace kairos
