// What `kairos info` says of a lattice.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "volume/field.h"

namespace kairos {

/// One line of `kairos info`: a name in a column of its own, and what there is to say.
std::string infoLine(const std::string& name, const std::string& text);

/// Lines for type, domain, voxel size, position and background.
std::string latticeText(const Lattice& lattice, const std::string& gridName);
/// The keys grid, element_type, background, dense, domain, world_from_index, voxel_size, world_bounds.
nlohmann::ordered_json latticeJson(const Lattice& lattice, const std::string& gridName);

std::string boxText(const VoxelBox& box);
std::string voxelSizeText(const Affine& worldFromIndex);

}  // namespace kairos
