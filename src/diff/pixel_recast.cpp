#include "diff/pixel_recast.h"

#include <algorithm>
#include <bit>
#include <mutex>

#include "core/stopwatch.h"
#include "diff/frame_assembly.h"
#include "raycast/morton.h"

namespace kairos {

struct PixelRecast::Counts {
  TileCounters work;
  uint64_t changed = 0, written = 0;
};

PixelRecast::PixelRecast(const SceneState& scene, const RendererOptions& options, Image& rgba, Image* depth)
    : scene_(scene),
      tilesPerTask_(options.tilesPerTask),
      rgba_(rgba),
      depth_(depth),
      caster_(scene.settings(), scene.volume(), scene.pool()),
      tileOrder_(mortonOrder(view().tilesX(), view().tilesY())),
      written_(size_t(view().width()) * size_t(view().height())),
      hasNumber_(tileOrder_.size()) {}

// Calls visit(lane, pixel) for the lanes of a tile that lie on the image; pixels are numbered row by row.
template <class Visit>
void PixelRecast::forEachPixel(size_t tile, Visit&& visit) const {
  const int x0 = int(tile) % view().tilesX() * kTileEdge, y0 = int(tile) / view().tilesX() * kTileEdge;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = x0 + lane % kTileEdge, y = y0 + lane / kTileEdge;
    if (x < view().width() && y < view().height())
      visit(lane, size_t(y) * size_t(view().width()) + size_t(x));
  }
}

// The lanes of a tile whose pixels have a number above 0.
uint32_t PixelRecast::writtenLanes(uint32_t tile, std::span<const int32_t> only) const {
  if (only.empty()) return kAllTileLanes;
  uint32_t lanes = 0;
  forEachPixel(tile, [&](int lane, size_t pixel) { lanes |= uint32_t(only[pixel] > 0) << lane; });
  return lanes;
}

Image PixelRecast::stepsSinceWritten() const {
  Image steps(view().width(), view().height(), 1);
  for (size_t i = 0; i < written_.size(); ++i) steps.data[i] = float(step_ - written_[i]);
  return steps;
}

const std::vector<uint32_t>& PixelRecast::tilesOf(std::span<const int32_t> numbers) {
  const auto width = size_t(view().width()), tilesX = size_t(view().tilesX());
  scene_.pool().forEach(size_t(view().tilesY()), 8, [&](size_t begin, size_t end) {
    for (size_t tileY = begin; tileY < end; ++tileY) {
      uint8_t* tiles = hasNumber_.data() + tileY * tilesX;
      std::fill_n(tiles, tilesX, uint8_t(0));
      const size_t last = std::min((tileY + 1) * kTileEdge, size_t(view().height()));
      for (size_t y = tileY * kTileEdge; y < last; ++y)
        for (size_t x = 0; x < width; ++x) tiles[x / kTileEdge] |= uint8_t(numbers[y * width + x] > 0);
    }
  });
  chosen_.clear();
  for (const uint32_t tile : tileOrder_)
    if (hasNumber_[tile]) chosen_.push_back(tile);
  return chosen_;
}

uint64_t PixelRecast::rayPoints(uint32_t tile) const {
  const auto visiblePoints = [&](std::span<const Segment> segments) {
    uint64_t points = 0;
    for (const Segment& s : segments)
      if (scene_.occupancy().visible(s.cell)) points += uint64_t(s.kEnd - s.kBegin) * kLanes;
    return points;
  };
  if (const SegmentIndex* index = caster_.index()) return visiblePoints(index->segments(int(tile)));
  PreparedTile walked;
  caster_.prepare(scene_.kernelScene(), int(tile), walked);
  return visiblePoints(walked.segments);
}

// The samples of one lane that visible bricks own.
uint64_t PixelRecast::rayPointsOfLane(const PreparedTile& tile, int lane) const {
  int64_t points = 0;
  for (const Segment& s : tile.segments) {
    if (!scene_.occupancy().visible(s.cell)) continue;
    int32_t from = std::max(s.kBegin, tile.rays.kBegin[lane]), to = std::min(s.kEnd, tile.rays.kEnd[lane]);
    const Vec3i cell = scene_.volume().cellCoordinates(s.cell);
    for (int a = 0; a < 3 && !tile.rays.packetOwned; ++a) {
      const double low = double(cell[a]) * kBrickEdge, high = low + kBrickEdge;
      const double origin = tile.rays.origin[a][lane] + view().footprintShift();
      const double delta = tile.rays.delta[a][lane];
      from = std::max(from, firstSampleBeyond(delta < 0 ? high : low, origin, delta));
      to = std::min(to, firstSampleBeyond(delta < 0 ? low : high, origin, delta));
    }
    points += std::max(to - from, 0);
  }
  return uint64_t(points);
}

Image PixelRecast::rayPointsOfPixels() const {
  Image points(view().width(), view().height(), 1);
  scene_.pool().forEach(size_t(view().tileCount()), 64, [&](size_t begin, size_t end) {
    PreparedTile prepared;
    for (size_t tile = begin; tile < end; ++tile) {
      if (!caster_.prepare(scene_.kernelScene(), int(tile), prepared)) continue;
      forEachPixel(
          tile, [&](int lane, size_t pixel) { points.data[pixel] = float(rayPointsOfLane(prepared, lane)); });
    }
  });
  return points;
}

void PixelRecast::castTile(uint32_t tile, uint32_t lanes, std::vector<float>& pixels, PreparedTile& prepared,
                           Counts& counts) {
  caster_.cast(scene_.kernelScene(), scene_.kernel(), int(tile), pixels.data(), prepared, counts.work);
  const int tileX = int(tile) % view().tilesX(), tileY = int(tile) / view().tilesX();
  counts.changed +=
      uint64_t(writeTile(scene_.settings(), scene_.table(), prepared.rays, scene_.volume().background(),
                         tileX, tileY, pixels.data(), rgba_, depth_, lanes));
  forEachPixel(tile, [&](int lane, size_t pixel) {
    if (lanes >> lane & 1) written_[pixel] = step_;
  });
  counts.written +=
      lanes == kAllTileLanes ? uint64_t(view().raysOf(int(tile))) : uint64_t(std::popcount(lanes));
}

void PixelRecast::cast(std::span<const uint32_t> tiles, std::span<const int32_t> only,
                       FrameStatistics& statistics) {
  Stopwatch clock;
  Counts total;
  std::mutex totalMutex;
  scene_.pool().forEach(tiles.size(), size_t(tilesPerTask_), [&](size_t begin, size_t end) {
    Counts counts;
    PreparedTile prepared;
    std::vector<float> pixels(size_t(scene_.settings().pixelPlanes()) * kLanes);
    for (size_t i = begin; i < end; ++i)
      castTile(tiles[i], writtenLanes(tiles[i], only), pixels, prepared, counts);
    std::lock_guard lock(totalMutex);
    total.work += counts.work;
    total.changed += counts.changed;
    total.written += counts.written;
  });
  statistics.castMs += clock.lap();
  for (const uint32_t tile : tiles) statistics.raysCast += uint64_t(view().raysOf(int(tile)));
  statistics.pixelsChanged += total.changed;
  statistics.pixelsRecast += total.written;
  statistics.segmentsTotal = caster_.index() ? caster_.index()->segmentCount()
                                             : total.work.segmentsComposited + total.work.segmentsSkipped;
  statistics.segmentsRecast += total.work.segmentsIntegrated;
  statistics.samples += total.work.samples;
  statistics.gradients += total.work.gradients;
  statistics.tilesRecast += tiles.size();
  statistics.tilesUncached += tiles.size();
}

}  // namespace kairos
