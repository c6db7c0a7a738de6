// From OpenVDB grids to the project's fields and changed voxels, without the OpenVDB library.
#pragma once

#include <span>
#include <string>

#include "io/vdb_container.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

/// The element type a grid of this type is kept in: f32, or u8 (0 and 1) for bool and mask grids.
ElementType elementTypeOf(const VdbGridType& type);

/// A background that two steps can agree in: the grid's, as the element type holds it.
double backgroundAs(ElementType type, double background);

/// The field of a grid: `tree` are bytes [grid.treeBegin, grid.end) of the file `path`. Their structure is
/// checked first. Values of inactive voxels count; tiles are expanded; leaves that hold only background are
/// dropped. `type` is elementTypeOf the grid, or u8/u16 for a float grid that holds whole numbers of that
/// range. Throws InputError.
Field fieldFromTree(const std::string& path, const VdbGridHeader& grid, std::span<const char> tree,
                    ElementType type);

/// The active voxels of a float grid as changed voxels; the checksums of the states are left empty.
ChangedVoxels changesFromTree(const std::string& path, const VdbGridHeader& grid, std::span<const char> tree,
                              ElementType type);

}  // namespace kairos
