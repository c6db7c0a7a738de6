// The packets of rays that coarser images are made of.
#pragma once

#include <array>
#include <cstdint>
#include <deque>

#include "tcdvrm/packet_colours.h"
#include "tcdvrm/step_levels.h"

namespace kairos {

/// Rays at a stride of 16, 8, 4 or 2 pixels in packets of 4x4, at every step level. The rays of stride 2 come
/// in four phases, shifted by (p & 1, p >> 1) pixels, so that one packet of each covers a block of 8x8 pixels
/// without casting any pixel twice. A packet of phase p, stride 2, is tile `block` of its view; one of stride
/// 4 covers 2x2 blocks, and so on.
class RefinementRays {
 public:
  enum Lattice { stride16, stride8, stride4, phase0, phase1, phase2, phase3, kLattices };

  /// Finds all lists of segments (once, the view is fixed).
  RefinementRays(const SceneState& scene, const StepLevels& levels);

  const ViewRays& view(Lattice lattice) const { return casters_[0][lattice].view(); }
  /// Casts one packet.
  void cast(int stepLevel, Lattice lattice, int tile, PacketColours& colours, PreparedTile& scratch,
            TileCounters& counters) const;
  uint64_t memoryBytes() const;

 private:
  const StepLevels& levels_;
  std::array<std::deque<TileCaster>, StepLevels::kCount> casters_;  // by Lattice
};

}  // namespace kairos
