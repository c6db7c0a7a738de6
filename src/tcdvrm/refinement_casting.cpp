// AdaptiveRefinement: casting a lattice and refining its blocks.
#include <algorithm>
#include <cmath>
#include <utility>

#include "tcdvrm/adaptive_refinement.h"

namespace kairos {
namespace {

// Nodes of a block's stride-2 packet that lie between two of stride 4, by column and row; and rays of its
// stride-1 packets, by lane and phase: those that teach the blend.
constexpr int kProbes[][2] = {{1, 0}, {3, 2}, {0, 1}, {2, 3}};
constexpr int kFineProbes[][2] = {{0, 1}, {10, 1}, {5, 2}, {15, 2}};

}  // namespace

void AdaptiveRefinement::castBatch(std::span<const Packet> packets) {
  if (packets.empty()) return;
  colours_.resize(packets.size());
  works_.resize(packets.size());
  meter_.beginCasting();
  scene_.pool().forEach(packets.size(), 2, [&](size_t begin, size_t end) {
    PreparedTile scratch;
    for (size_t p = begin; p < end; ++p) {
      TileCounters counters;
      rays_.cast(stepLevel_, packets[p].lattice, packets[p].tile, colours_[p], scratch, counters);
      works_[p] = {double(counters.samples), double(counters.segmentsIntegrated)};
    }
  });
  charge(packets.size(), packets.front().lattice < RefinementRays::stride4);
}

// What the last batch was. Packets of wide strides reach beyond a brick's apron and cost more than their
// samples tell: by how much is learned apart.
void AdaptiveRefinement::charge(size_t packets, bool wide) {
  CastWork sum;
  for (const CastWork& work : works_) sum += work;
  const double expected = meter_.cost(sum);
  const double took = meter_.endCasting(sum, !wide);
  if (wide && meter_.timed() && expected > 0)
    wideCost_ = std::lerp(wideCost_, std::clamp(took / expected, 1.0, 8.0), 0.3);
  total_ += sum;
  raysCast_ += packets * kLanes;
}

// Casts packets in their order while the budget lasts; `take(packet, colours, work)` for each. Returns how
// many were cast. `before` is called with the packets left before each batch.
template <class Before, class Take>
size_t AdaptiveRefinement::castInBatches(std::span<const Packet> packets, Before&& before, Take&& take) {
  size_t done = 0;
  while (done < packets.size()) {
    before(packets.subspan(done));
    const double budget = batchBudget();
    size_t end = done;
    for (double cost = 0; end < packets.size(); ++end) {
      cost += costOf(packets[end]);
      if (cost > budget) break;
    }
    if (end == done) break;
    castBatch(packets.subspan(done, end - done));
    for (size_t p = done; p < end; ++p) take(packets[p], colours_[p - done], works_[p - done]);
    done = end;
  }
  return done;
}

double AdaptiveRefinement::costOf(const Packet& packet) const {
  return packet.lattice == RefinementRays::stride4 ? meter_.cost(workOf(packet.owner, stepLevel_))
                                                   : meter_.cost(workOf(stepLevel_)) * wideCost();
}

// The nodes of stride 4 of all units, or a coarser lattice whose units wait for them in the queue.
void AdaptiveRefinement::castLattice() {
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column)
      stride_[live_.index(column, run.row)] = uint8_t(kNothing);
  if (plan_.stride > 4) return castCoarseLattice();
  packets_.clear();
  for (const uint32_t unit : units_) packets_.push_back({RefinementRays::stride4, int(unit), unit});
  // It begins where the last one broke off, if it did.
  const auto first = std::find(units_.begin(), units_.end(), firstUnit_);
  if (first != units_.end())
    std::rotate(packets_.begin(), packets_.begin() + (first - units_.begin()), packets_.end());
  const size_t done = castInBatches(
      packets_, [&](std::span<const Packet> rest) { lengthenStep(rest); },
      [&](const Packet& packet, const PacketColours& colours, const CastWork& work) {
        takeStride4(packet, colours, work);
      });
  tooSmall_ = done < packets_.size();
  if (!tooSmall_) return;
  firstUnit_ = packets_[done].owner;
  // What was not reached stays as it is.
  for (size_t b = 0; b < live_.size(); ++b)
    if (live_.contains(b) && stride_[b] == kNothing) live_.set(b, false);
  runs_ = live_.runs();
}

// A lattice that takes longer than was expected goes on with longer sample distances: part of it left out
// would be far worse.
void AdaptiveRefinement::lengthenStep(std::span<const Packet> rest) {
  const double left = castingBudget();
  for (; stepLevel_ < StepLevels::kCount - 1; ++stepLevel_) {
    double cost = 0;
    for (const Packet& packet : rest) cost += costOf(packet);
    if (cost <= left) return;
  }
}

void AdaptiveRefinement::takeStride4(const Packet& packet, const PacketColours& colours, CastWork work) {
  unitWork_[packet.owner] = {work.samples * double(1 << stepLevel_), work.segments};
  keepNodes(packet, colours);
}

// Every 8th or 16th pixel.
void AdaptiveRefinement::castCoarseLattice() {
  const RefinementRays::Lattice lattice =
      plan_.stride == 8 ? RefinementRays::stride8 : RefinementRays::stride16;
  const int edge = plan_.stride / 4;  // units along a packet's
  const int width = rays_.view(RefinementRays::stride4).tilesX(), tiles = rays_.view(lattice).tilesX();
  pyramid_.takeImage(3);
  std::vector<Packet> coarse;
  std::vector<uint8_t> listed(size_t(rays_.view(lattice).tileCount()), 0);
  for (const uint32_t u : units_) {
    const int tile = int(u) / width / edge * tiles + int(u) % width / edge;
    if (std::exchange(listed[size_t(tile)], uint8_t(1))) continue;
    coarse.push_back({lattice, tile, 0});
  }
  const size_t done = castInBatches(
      coarse, [&](std::span<const Packet> rest) { lengthenStep(rest); },
      [&](const Packet& packet, const PacketColours& colours, const CastWork&) {
        keepNodes(packet, colours);
      });
  tooSmall_ = done < coarse.size();
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last && !tooSmall_; ++column) {
      uint8_t& stride = stride_[live_.index(column, run.row)];
      stride = std::min(stride, uint8_t(plan_.stride));
    }
  if (plan_.stride == 16) pyramid_.interpolate(3, runs_, nullptr);
  pyramid_.interpolate(2, runs_, nullptr);
  if (plan_.stride == 8) expectFromCoarse();
}

// What the nodes of stride 8 themselves show of the error between them.
void AdaptiveRefinement::expectFromCoarse() {
  const NodeGrid& grid = pyramid_.grid(3);
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column) {
      if (((column | run.row) & 1) == 0 || (column & run.row & 1)) continue;
      const Float4 cubic = column & 1 ? ColourPyramid::cubicAlongRow(grid, column, run.row, 1)
                                      : ColourPyramid::cubicAlongColumn(grid, column, run.row, 1);
      const size_t b = live_.index(column, run.row);
      const float shown = squaredDistance(grid.node(column, run.row), cubic);
      error8_[b] = 0.5f * (error8_[b] + shown * float(ratio8_));
    }
  findUnitGains();
}

void AdaptiveRefinement::keepNodes(const Packet& packet, const PacketColours& colours) {
  const int level = 4 - int(packet.lattice);  // stride16 is the pyramid's level 4
  const NodeGrid& grid = pyramid_.grid(level);
  const int tilesX = rays_.view(packet.lattice).tilesX();
  const int i0 = packet.tile % tilesX * kTileEdge, j0 = packet.tile / tilesX * kTileEdge;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int i = i0 + lane % kTileEdge, j = j0 + lane / kTileEdge;
    if (i >= grid.columns || j >= grid.rows) continue;
    const int x = i * grid.stride, y = j * grid.stride;
    const size_t block = live_.blockAt(x, y);
    if (!live_.contains(block)) continue;
    store4(grid.node(i, j), load4(colours.rgba[lane]));
    markCast(x, y);
    stride_[block] = std::min(stride_[block], uint8_t(grid.stride));
  }
}

// Every unit that is still coarser than stride 4 waits for that, every other block for stride 2.
void AdaptiveRefinement::queueBlocks() {
  if (plan_.stride > 4)
    for (const uint32_t unit : units_)
      queue_.push(float(unitGain_[unit] / effort(workOf(unit, stepLevel_))), {unit, 4});
  for (const BlockRun& run : runs_)
    for (int column = run.first; column < run.last; ++column)
      if (stride_[live_.index(column, run.row)] == 4) pushStride2(column, run.row);
}

// What earlier frames left at a stride of 4 or 2 goes on from there.
void AdaptiveRefinement::queueOwed() {
  for (uint32_t b = 0; b < uncertain_.size(); ++b) {
    if (!uncertain_.contains(b) || live_.contains(b)) continue;
    if (stride_[b] == 2) pushStride1(b);
    if (stride_[b] != 4) continue;
    pushStride2(b);
  }
}

// Does the image still have the previous step's detail there?
bool AdaptiveRefinement::showsOld(uint32_t block) const {
  return live_.contains(block) && !assembled_;
}

// Is it one that earlier frames left?
void AdaptiveRefinement::takeUp(uint32_t block) {
  if (!live_.contains(block)) added_.set(block, true);
}

// With the error that an earlier frame saw there, and that this frame's lattice lets expect.
void AdaptiveRefinement::pushStride2(int column, int row) {
  const auto b = uint32_t(live_.index(column, row));
  const float shown = latticeResidual(column, row);
  seen_.error8 += shown;
  seen_.expected8 += error8_[b];
  error8_[b] = shown;
  error4_[b] = std::max(0.5f * (error4_[b] + shown * float(ratio4_)), kLeastError);
  error2_[b] = std::min(error2_[b], error4_[b]);
  pushStride2(b);
}

void AdaptiveRefinement::pushStride2(uint32_t block) {
  const double gain = std::max(error4(block) - error2(block), error4(block) / 4);
  queue_.push(float(gain / effort(workOf(unitOf_[block], stepLevel_))), {block, 2});
}

void AdaptiveRefinement::pushStride1(uint32_t block) {
  const double cost = 3 * effort(workOf(unitOf_[block], stepLevel_));
  queue_.push(float(error2(block) / cost), {block, 1});
}

void AdaptiveRefinement::refineBlocks() {
  std::vector<Item> items;
  while (takeItems(items)) {
    castBatch(packets_);
    const PacketColours* colours = colours_.data();
    std::vector<uint32_t> units;
    for (const Item& item : items) {
      const auto packet = size_t(colours - colours_.data());
      if (item.stride == 4) {
        takeStride4(packets_[packet], *colours++, works_[packet]);
        units.push_back(item.block);
      } else if (item.stride == 2) {
        takeStride2(item.block, *colours++);
      } else {
        takeStride1(item.block, std::exchange(colours, colours + 3));
      }
    }
    if (!units.empty()) refineUnits(units);
  }
}

// The most urgent items of the queue that fit a batch, with their packets. False when there are none, or the
// frame is good enough.
bool AdaptiveRefinement::takeItems(std::vector<Item>& items) {
  const double budget = batchBudget(), wanted = goal_ ? goal_->batchGain(expectedTotal()) : INFINITY;
  const size_t least = goal_ ? goal_->takeLeast() : 0;
  items.clear();
  packets_.clear();
  for (double cost = 0, gain = 0; !queue_.empty() && (gain < wanted || items.size() < least);) {
    const Item item = queue_.top();
    gain += goal_ ? gainOf(item) : 0;
    const uint32_t unit = item.stride == 4 ? item.block : unitOf_[item.block];
    cost += meter_.cost(workOf(unit, stepLevel_)) * (item.stride == 1 ? 3 : 1);
    if (cost > budget) break;
    queue_.pop();
    items.push_back(item);
    if (item.stride == 4)
      packets_.push_back({RefinementRays::stride4, int(unit), unit});
    else if (item.stride == 2)
      packets_.push_back(phasePacket(item.block, 0));
    else
      for (int phase = 1; phase < 4; ++phase) packets_.push_back(phasePacket(item.block, phase));
  }
  return !items.empty();
}

// Units that have their nodes of stride 4 now: their blocks follow.
void AdaptiveRefinement::refineUnits(std::span<const uint32_t> units) {
  BlockSet blocks(image_.width, image_.height);
  for (const uint32_t unit : units)
    for (const uint32_t block : liveBlocksOf(unit)) blocks.set(block, true);
  const std::vector<BlockRun> runs = blocks.runs();
  pyramid_.interpolate(1, runs, blending_ ? &blend_ : nullptr);
  for (const BlockRun& run : runs)
    for (int column = run.first; column < run.last; ++column) pushStride2(column, run.row);
}

std::vector<uint32_t> AdaptiveRefinement::liveBlocksOf(uint32_t unit) const {
  std::vector<uint32_t> blocks;
  const int width = rays_.view(RefinementRays::stride4).tilesX();
  for (int b = 0; b < kUnitBlocks * kUnitBlocks; ++b) {
    const int column = int(unit) % width * kUnitBlocks + b % kUnitBlocks;
    const int row = int(unit) / width * kUnitBlocks + b / kUnitBlocks;
    if (column < live_.columns() && row < live_.rows() && live_.contains(column, row))
      blocks.push_back(uint32_t(live_.index(column, row)));
  }
  return blocks;
}

AdaptiveRefinement::Packet AdaptiveRefinement::phasePacket(uint32_t block, int phase) const {
  // Packets of stride 2 are numbered like blocks.
  return {RefinementRays::Lattice(RefinementRays::phase0 + phase), int(block), block};
}

// The nodes of stride 2 of a block: they tell its error at stride 4, and how much of the old detail persists.
void AdaptiveRefinement::takeStride2(uint32_t block, const PacketColours& colours) {
  const NodeGrid& half = pyramid_.grid(1);
  const int i0 = int(block) % live_.columns() * kTileEdge, j0 = int(block) / live_.columns() * kTileEdge;
  takeUp(block);
  const double blended = learnDetail(block, colours);
  float sum = 0;
  int count = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int i = i0 + lane % kTileEdge, j = j0 + lane / kTileEdge;
    if (i >= half.columns || j >= half.rows) continue;
    if ((i | j) & 1) {
      sum += squaredDistance(half.node(i, j), load4(colours.rgba[lane]));
      ++count;
    }
    store4(half.node(i, j), load4(colours.rgba[lane]));
    markCast(2 * i, 2 * j);
  }
  stride_[block] = 2;
  detailFoundIn_[1][block] = frame_;
  if (count == 0) return;
  // Without the old detail's share, as all that is remembered of errors.
  const float error = std::max(sum / float(count * blended), kLeastError);
  seen_.error4 += error;
  seen_.expected4 += error8_[block] * float(ratio4_);
  error2_[block] = 0.5f * (std::min(error2_[block], error) + error * float(ratio2_));
  error4_[block] = error;
  pushStride1(block);
}

// Before a block's nodes of stride 2 are stored. Returns the error with the old detail's share to that
// without.
double AdaptiveRefinement::learnDetail(uint32_t block, const PacketColours& colours) {
  if (!showsOld(block)) return 1;
  const NodeGrid &half = pyramid_.grid(1), &full = pyramid_.grid(0);
  const bool fresh = detailAge(1, block) <= DetailAge::kOldest;
  double with = 0, without = 0;
  for (const auto& [x, y] : kProbes) {
    const int i = int(block) % live_.columns() * kTileEdge + x,
              j = int(block) / live_.columns() * kTileEdge + y;
    if (i >= half.columns || j >= half.rows) continue;
    const Float4 now = load4(colours.rgba[x + kTileEdge * y]), before = load4(full.node(2 * i, 2 * j));
    const bool row = i & 1;
    const Float4 residual = now - (row ? ColourPyramid::cubicAlongRow(half, i, j, 1)
                                       : ColourPyramid::cubicAlongColumn(half, i, j, 1));
    const Float4 old = before - (row ? ColourPyramid::cubicAlongRow(full, 2 * i, 2 * j, 2)
                                     : ColourPyramid::cubicAlongColumn(full, 2 * i, 2 * j, 2));
    if (fresh) blend_.observe(1, 2 * i, 2 * j, residual, old);
    const Float4 left = now - load4(half.node(i, j));
    with += double(sum4(left * left));
    without += double(sum4(residual * residual));
  }
  if (!blending_ || !fresh || without <= 0) return 1;
  detailAge_[1].observe(detailAge(1, block), with, without);
  return std::clamp(with / without, 0.01, 1.0);
}

// The other pixels of a block, in three packets.
void AdaptiveRefinement::takeStride1(uint32_t block, const PacketColours* phases) {
  const NodeGrid &half = pyramid_.grid(1), &full = pyramid_.grid(0);
  const int x0 = int(block) % live_.columns() * kBlockEdge, y0 = int(block) / live_.columns() * kBlockEdge;
  takeUp(block);
  const bool fresh = showsOld(block) && detailAge(0, block) <= DetailAge::kOldest;
  double with = 0, without = 0;
  for (const auto& [lane, phase] : kFineProbes) {
    const int i = x0 / 2 + lane % kTileEdge, j = y0 / 2 + lane / kTileEdge;
    const int x = 2 * i + (phase & 1), y = 2 * j + (phase >> 1);
    if (x >= full.columns || y >= full.rows) continue;
    const Float4 now = load4(phases[phase - 1].rgba[lane]);
    const bool row = phase == 1;
    const Float4 residual =
        now - (row ? ColourPyramid::cubicAfterColumn(half, i, j) : ColourPyramid::cubicAfterRow(half, i, j));
    const Float4 before = load4(full.node(x, y)) - (row ? ColourPyramid::cubicAlongRow(full, x, y, 1)
                                                        : ColourPyramid::cubicAlongColumn(full, x, y, 1));
    if (fresh) blend_.observe(0, x, y, residual, before);
    const Float4 left = blending_ && fresh ? residual - blend_.lambda(0, x, y) * before : residual;
    with += double(sum4(left * left));
    without += double(sum4(residual * residual));
  }
  if (blending_ && fresh) detailAge_[0].observe(detailAge(0, block), with, without);
  detailFoundIn_[0][block] = frame_;
  stride_[block] = 1;
  fineAt_[block] = uint32_t(fine_.size());
  fine_.insert(fine_.end(), phases, phases + 3);
  const float error = std::max(float(without) / float(std::size(kFineProbes)), kLeastError);
  seen_.error2 += error;
  seen_.expected2 += error4_[block];
  error2_[block] = error;
}

}  // namespace kairos
