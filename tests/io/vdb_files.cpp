#include "io/vdb_files.h"

#include <openvdb/io/File.h>

namespace kairos::test {

void writeVdb(const std::string& path, const openvdb::GridPtrVec& grids, uint32_t compression,
              bool statistics) {
  openvdb::initialize();
  openvdb::io::File file(path);
  file.setCompression(compression);
  file.setGridStatsMetadataEnabled(statistics);
  file.write(grids);
}

openvdb::FloatGrid::Ptr blobGrid(openvdb::Coord centre, int radius, float scale) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(0);
  grid->setName("density");
  for (int x = -radius; x <= radius; ++x)
    for (int y = -radius; y <= radius; ++y)
      for (int z = -radius; z <= radius; ++z)
        if (const int d = x * x + y * y + z * z; d < radius * radius)
          grid->tree().setValueOn(centre.offsetBy(x, y, z), scale * float(1 + x + 10 * y) / float(1 + d));
  return grid;
}

}  // namespace kairos::test
