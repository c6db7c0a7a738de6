// The texels of a subvolume, made to fit its neighbours.
#pragma once

#include <cstdint>
#include <vector>

#include "lod/level_transition.h"

namespace kairos {

/// Writes subvolume i's vertices at levels[i], x fastest, with transitions to coarser neighbours. Where a
/// vertex on its faces also belongs to a coarser subvolume, the value is the coarsest one's, interpolated
/// (Weiler et al. 2000; Li and Shen 2002, 3.1): interpolation then agrees on both sides of every face, edge
/// and corner.
void copyTexels(const ScalarPyramid& pyramid, const Subdivision& subdivision, const SubvolumeLevels& levels,
                uint32_t i, std::vector<float>& texels);

/// A hash of all that decides the values `copyTexels` takes from neighbours. Equal signatures mean equal
/// texels while the volume stays as it is; 0 where no neighbour is coarser.
uint64_t boundarySignature(const Subdivision& subdivision, const SubvolumeLevels& levels, uint32_t i);

}  // namespace kairos
