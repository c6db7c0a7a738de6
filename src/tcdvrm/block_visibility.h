// Which blocks of the image anything visible can show in.
#pragma once

#include <cstdint>
#include <vector>

#include "raycast/scene_state.h"
#include "raycast/tile_caster.h"
#include "tcdvrm/live_blocks.h"

namespace kairos {

/// A block of 8x8 pixels is blank, exactly, while none of the windows that its rays cross is visible. Follows
/// the scene from step to step.
class BlockVisibility {
 public:
  /// The caster of the exact image, one ray a pixel, with segment lists; finds which windows each block's
  /// rays cross.
  explicit BlockVisibility(const TileCaster& caster, const SceneState& scene);

  /// After SceneState::start.
  void restart();
  /// After SceneState::apply. Returns the blocks whose rays read changed voxels through windows that are or
  /// were visible; all others show what they showed before, exactly.
  const BlockSet& follow(const AppliedChanges& applied);

  bool visible(size_t block) const { return visibleEntries_[block] > 0; }
  /// All that are visible.
  BlockSet blocks() const;

 private:
  // What the rays of one block cross of one brick.
  struct Entry {
    uint32_t block;
    bool visible;
    uint64_t windows, subBlocks;
  };
  struct Crossing {
    uint32_t cell, block;
    uint64_t windows, subBlocks;
  };
  void findCrossings(const TileCaster& caster, const Vec3i& gridSize, const BlockSet& blocks, uint32_t block,
                     std::vector<Crossing>& crossings) const;
  template <class Body>
  void judge(uint32_t cell, Body&& body);

  const SceneState& scene_;
  BlockSet blocks_, touched_;        // blocks_: an empty one of the image's size
  std::vector<uint64_t> windows_;    // per cell: visible ones, as of the last step
  std::vector<uint64_t> cellBegin_;  // of its entries, per cell
  std::vector<Entry> entries_;
  std::vector<uint32_t> visibleEntries_;  // per block
};

}  // namespace kairos
