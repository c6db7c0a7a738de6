// Which bricks can change an image, under one transfer function and mode.
#pragma once

#include <cstdint>
#include <vector>

#include "raycast/render_settings.h"
#include "volume/brick_volume.h"

namespace kairos {

/// One flag per cell. A brick that is not visible adds exactly nothing to any ray through it, so leaving it
/// out cannot change a bit of the image: dvr: every value between its smallest and largest classifies to zero
/// opacity; average: it holds nothing but the background. mip: likewise; rays that meet it still see the
/// background.
class Occupancy {
 public:
  Occupancy(const RenderSettings& settings, const ClassificationTable& table);

  void build(const BrickVolume& volume);
  /// Refreshes what an update of the volume touched. `before[i]` receives the earlier flag of dirty.cells[i].
  void update(const BrickVolume& volume, const DirtyBricks& dirty, std::vector<uint8_t>& before);

  bool visible(uint32_t cell) const { return visible_[cell] != 0; }
  /// One bit per window of each brick (see kWindows): samples whose footprint starts in a window's block add
  /// exactly nothing where its bit is clear. So do slabs that run from one such window to another.
  const uint64_t* windows() const { return windows_.data(); }
  const uint8_t* flags() const { return visible_.data(); }
  uint32_t visibleCount() const { return visibleCount_; }

 private:
  uint64_t judge(const BrickVolume& volume, uint32_t cell, uint64_t dirty) const;
  bool judgeRange(ValueRange range) const;
  bool judgeBrick(ValueRange range) const;
  bool judgeWindow(ValueRange window, ValueRange brick) const;

  const ClassificationTable& table_;
  RenderMode mode_;
  bool slabs_, skip_;
  float background_ = 0;
  std::vector<uint8_t> visible_;
  std::vector<uint64_t> windows_;
  uint32_t visibleCount_ = 0;
};

}  // namespace kairos
