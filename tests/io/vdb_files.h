// OpenVDB files as simulations write them.
#pragma once

#include <openvdb/openvdb.h>

#include <string>

namespace kairos::test {

void writeVdb(const std::string& path, const openvdb::GridPtrVec& grids,
              uint32_t compression = openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK,
              bool statistics = true);

/// A blob of values around `centre`, background 0, named "density".
openvdb::FloatGrid::Ptr blobGrid(openvdb::Coord centre, int radius, float scale = 1);

}  // namespace kairos::test
