// Writing OpenVDB files of one float grid, without the OpenVDB library.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

using VdbMetadataEntry = std::pair<std::string, std::variant<std::string, int64_t, double>>;

/// A file that holds one float grid, as bytes: format 224, active values compressed by Blosc, stored as
/// halves where none is rounded by that. The same content gives the same bytes. `vdbFromField`: voxels that
/// differ bitwise from the background are active. `vdbFromChanges`: the changed voxels are.
std::string vdbFromField(const Field& field, const Lattice& lattice, const std::string& gridName,
                         const std::vector<VdbMetadataEntry>& metadata);
std::string vdbFromChanges(const ChangedVoxels& changes, const Lattice& lattice, const std::string& gridName,
                           const std::vector<VdbMetadataEntry>& metadata);

}  // namespace kairos
