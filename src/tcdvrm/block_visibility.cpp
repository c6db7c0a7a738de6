#include "tcdvrm/block_visibility.h"

#include <algorithm>
#include <numeric>

namespace kairos {

BlockVisibility::BlockVisibility(const TileCaster& caster, const SceneState& scene)
    : scene_(scene), blocks_(scene.settings().width, scene.settings().height), touched_(blocks_) {
  std::vector<std::vector<Crossing>> rows(static_cast<size_t>(blocks_.rows()));
  scene.pool().forEach(rows.size(), 1, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row)
      for (int column = 0; column < blocks_.columns(); ++column)
        findCrossings(caster, scene.volume().gridSize(), blocks_, uint32_t(blocks_.index(column, int(row))),
                      rows[row]);
  });
  cellBegin_.assign(size_t(scene.volume().cellCount()) + 1, 0);
  for (const auto& row : rows)
    for (const Crossing& c : row) ++cellBegin_[c.cell + 1];
  std::partial_sum(cellBegin_.begin(), cellBegin_.end(), cellBegin_.begin());
  entries_.resize(cellBegin_.back());
  std::vector<uint64_t> next(cellBegin_.begin(), cellBegin_.end() - 1);
  for (const auto& row : rows)
    for (const Crossing& c : row) entries_[next[c.cell]++] = {c.block, false, c.windows, c.subBlocks};
}

// Appends one crossing for each brick that the block's rays meet.
void BlockVisibility::findCrossings(const TileCaster& caster, const Vec3i& gridSize, const BlockSet& blocks,
                                    uint32_t block, std::vector<Crossing>& crossings) const {
  const ViewRays& view = caster.view();
  const size_t first = crossings.size();
  const int x0 = int(block) % blocks.columns() * 2, y0 = int(block) / blocks.columns() * 2;
  for (int y = y0; y < std::min(y0 + 2, view.tilesY()); ++y)
    for (int x = x0; x < std::min(x0 + 2, view.tilesX()); ++x) {
      const int tile = y * view.tilesX() + x;
      const auto segments = caster.index()->segments(tile);
      if (segments.empty()) continue;
      const TileRays rays = view.rays(tile);
      for (const Segment& segment : segments) {
        // A slab reaches beyond the samples' own windows, and curvature beyond that.
        const uint64_t windows =
            scene_.settings().slabs() ? ~uint64_t(0) : touchedWindows(view, rays, gridSize, segment);
        const uint64_t subBlocks = touchedSubBlocks(view, rays, gridSize, segment);
        const auto same = std::find_if(crossings.begin() + long(first), crossings.end(),
                                       [&](const Crossing& c) { return c.cell == segment.cell; });
        if (same == crossings.end()) {
          crossings.push_back({segment.cell, block, windows, subBlocks});
        } else {
          same->windows |= windows;
          same->subBlocks |= subBlocks;
        }
      }
    }
}

void BlockVisibility::restart() {
  for (Entry& entry : entries_) entry.visible = false;
  visibleEntries_.assign(blocks_.size(), 0);
  windows_.assign(cellBegin_.size() - 1, 0);
  for (uint32_t cell = 0; cell + 1 < cellBegin_.size(); ++cell) judge(cell, [](const Entry&) {});
}

const BlockSet& BlockVisibility::follow(const AppliedChanges& applied) {
  touched_.clear();
  for (size_t i = 0; i < applied.cells.size(); ++i) {
    const uint32_t cell = applied.cells[i];
    const uint64_t either = windows_[cell] | scene_.occupancy().windows()[cell];
    if (either == 0) continue;
    const uint64_t changed = applied.subBlocks[i];
    judge(cell, [&](const Entry& entry) {
      if ((entry.windows & either) != 0 && (entry.subBlocks & changed) != 0) touched_.set(entry.block, true);
    });
  }
  return touched_;
}

// Brings the entries of a cell up to date, and calls body(entry) for each.
template <class Body>
void BlockVisibility::judge(uint32_t cell, Body&& body) {
  const uint64_t windows = windows_[cell] = scene_.occupancy().windows()[cell];
  for (uint64_t e = cellBegin_[cell]; e < cellBegin_[cell + 1]; ++e) {
    Entry& entry = entries_[e];
    const bool visible = (entry.windows & windows) != 0;
    visibleEntries_[entry.block] += uint32_t(visible) - uint32_t(entry.visible);
    entry.visible = visible;
    body(entry);
  }
}

BlockSet BlockVisibility::blocks() const {
  BlockSet visible = blocks_;
  for (size_t b = 0; b < visible.size(); ++b) visible.set(b, visibleEntries_[b] > 0);
  return visible;
}

}  // namespace kairos
