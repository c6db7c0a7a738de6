#include "app/lattice_info.h"

#include <nlohmann/json.hpp>

#include "app/text_format.h"

namespace kairos {

namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json json(const Vec3<T>& v) {
  return Json::array({v.x, v.y, v.z});
}

std::string text(const Vec3d& v) {
  return formatted("(%.8g, %.8g, %.8g)", v.x, v.y, v.z);
}

Vec3d voxelSizes(const Affine& a) {
  return {length(a.column[0]), length(a.column[1]), length(a.column[2])};
}

bool isAxisAligned(const Affine& a) {
  return a.column == Affine::scale({a.column[0].x, a.column[1].y, a.column[2].z}).column;
}

}  // namespace

std::string infoLine(const std::string& name, const std::string& text) {
  return formatted("  %-14s%s\n", name.c_str(), text.c_str());
}

std::string boxText(const VoxelBox& box) {
  if (box.empty()) return "empty";
  const Vec3i n = box.size();
  return formatted("%d x %d x %d voxels from (%d, %d, %d)", n.x, n.y, n.z, box.lo.x, box.lo.y, box.lo.z);
}

std::string voxelSizeText(const Affine& worldFromIndex) {
  const Vec3d size = voxelSizes(worldFromIndex);
  if (size.x == size.y && size.y == size.z) return formatted("%.8g", size.x);
  return formatted("%.8g x %.8g x %.8g", size.x, size.y, size.z);
}

std::string latticeText(const Lattice& lattice, const std::string& gridName) {
  const Affine& m = lattice.worldFromIndex;
  const PointBox world = lattice.worldBounds();
  std::string lines;
  if (!gridName.empty()) lines += infoLine("grid", gridName);
  lines += infoLine("values",
                    std::string(name(lattice.type)) + formatted(", background %.9g", lattice.background));
  lines += infoLine("domain", boxText(lattice.domain) + (lattice.dense ? ", dense" : ""));
  lines += infoLine("voxel size", voxelSizeText(m));
  if (!isAxisAligned(m))
    lines += infoLine("voxel axes", text(m.column[0]) + ", " + text(m.column[1]) + ", " + text(m.column[2]));
  lines += infoLine("world bounds", text(world.lo) + " to " + text(world.hi));
  return lines;
}

Json latticeJson(const Lattice& lattice, const std::string& gridName) {
  const Affine& m = lattice.worldFromIndex;
  const PointBox world = lattice.worldBounds();
  Json j;
  j["grid"] = gridName;
  j["element_type"] = name(lattice.type);
  j["background"] = lattice.background;
  j["dense"] = lattice.dense;
  j["domain"] = {{"lo", json(lattice.domain.lo)},
                 {"hi", json(lattice.domain.hi)},
                 {"size", json(lattice.domain.size())}};
  j["world_from_index"] = {{"x", json(m.column[0])},
                           {"y", json(m.column[1])},
                           {"z", json(m.column[2])},
                           {"origin", json(m.translation)}};
  j["voxel_size"] = json(voxelSizes(m));
  j["world_bounds"] = {{"lo", json(world.lo)}, {"hi", json(world.hi)}};
  return j;
}

}  // namespace kairos
