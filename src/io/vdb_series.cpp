// OpenVDB sequences: one grid of one file per step.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "io/file_bytes.h"
#include "io/series_formats.h"
#include "io/vdb_container.h"
#include "io/vdb_field.h"

namespace kairos {
namespace {

std::string text(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", v);
  return buffer;
}

std::string text(const Vec3d& v) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.9g, %.9g, %.9g)", v.x, v.y, v.z);
  return buffer;
}

Vec3d voxelSizeOf(const Affine& a) {
  return {length(a.column[0]), length(a.column[1]), length(a.column[2])};
}

bool nearlyEqual(const Vec3d& a, const Vec3d& b, double scale) {
  constexpr double kTolerance = 1e-9;  // relative; programs recompute transforms for every frame
  return length(a - b) <= kTolerance * scale;
}

bool nearlyEqual(const Affine& a, const Affine& b) {
  for (int c = 0; c < 3; ++c)
    if (!nearlyEqual(a.column[size_t(c)], b.column[size_t(c)], length(a.column[size_t(c)]))) return false;
  return nearlyEqual(a.translation, b.translation, std::max(length(a.translation), a.voxelSize()));
}

void requireUsable(const std::string& path, const VdbGridHeader& grid) {
  if (!grid.type() || !grid.type()->scalar)
    throw InputError(path, "grid \"" + grid.name + "\" has type " +
                               (grid.type() ? grid.type()->valueName : grid.typeName) +
                               ", expected a scalar (float, double, int32, int64, bool or mask)");
  if (!grid.transform)
    throw InputError(
        path, "grid \"" + grid.name + "\" has a " + grid.mapType + " transform, expected an affine one");
  const Affine& m = *grid.transform;
  const Vec3d size = voxelSizeOf(m);
  const double volume = std::abs(m.determinant()), edges = size.x * size.y * size.z;
  if (!std::isfinite(volume) || !std::isfinite(length(m.translation)) || !(volume > 1e-12 * edges))
    throw InputError(path, "grid \"" + grid.name + "\" has a singular transform, voxel size " + text(size));
  if (!std::isfinite(float(grid.background)))
    throw InputError(path, "grid \"" + grid.name + "\" has background " + text(grid.background) +
                               ", expected a finite number");
}

ByteBuffer treeBytes(const InputFile& file, const VdbGridHeader& grid) {
  if (grid.end > file.size() || grid.treeBegin > grid.end)
    throw InputError(file.path(), "is truncated: grid \"" + grid.name + "\" ends at byte " +
                                      std::to_string(grid.end) + " of " + std::to_string(file.size()));
  return file.read(grid.treeBegin, size_t(grid.end - grid.treeBegin));
}

Field readGrid(const InputFile& file, const VdbGridHeader& grid) {
  requireUsable(file.path(), grid);
  return fieldFromTree(file.path(), grid, treeBytes(file, grid), elementTypeOf(*grid.type()));
}

bool isConstant(const Field& field) {
  return std::visit(
      [&](const auto& values) {
        return field.bounds.empty() ||
               (size_t(field.bounds.voxelCount()) == values.size() &&
                std::all_of(values.begin(), values.end(), [&](auto v) { return v == values[0]; }));
      },
      field.values);
}

// Does the grid hold anything to see? A grid that is one constant (Blender's shadow) does not.
bool isCandidate(const InputFile& file, const VdbGridHeader& grid) {
  if (const auto bounds = grid.activeBounds(); bounds && bounds->empty()) return false;
  return grid.transform && !isConstant(readGrid(file, grid));
}

std::vector<const VdbGridHeader*> scalarGrids(const VdbContainer& container) {
  std::vector<const VdbGridHeader*> grids;
  for (const VdbGridHeader& grid : container.grids)
    if (grid.type() && grid.type()->scalar) grids.push_back(&grid);
  return grids;
}

std::string listed(const std::vector<const VdbGridHeader*>& grids) {
  std::string list;
  for (const VdbGridHeader* grid : grids)
    (list += list.empty() ? "" : ", ") += grid->name + " (" + grid->type()->valueName + ")";
  return list;
}

// The grid a user means who names none: "density", or the only scalar grid with something in it. A grid may
// be empty in the first steps, so the first file that decides counts.
std::string defaultGrid(const std::vector<StepFile>& steps) {
  for (const StepFile& step : steps) {
    const InputFile file(step.path);
    ByteReader reader(file);
    const VdbContainer container = readVdbContainer(reader);
    const auto scalars = scalarGrids(container);
    if (scalars.empty()) throw InputError(step.path, "holds no scalar grid but " + container.gridList());
    if (scalars.size() == 1) return scalars.front()->name;
    std::vector<const VdbGridHeader*> candidates;
    for (const VdbGridHeader* grid : scalars) {
      if (grid->name == "density") return grid->name;
      if (isCandidate(file, *grid)) candidates.push_back(grid);
    }
    if (candidates.size() == 1) return candidates.front()->name;
    if (candidates.size() > 1)
      throw InputError(step.path, "holds several grids that could be meant: " + listed(candidates) +
                                      "; choose with --grid");
  }
  throw InputError(steps.front().path,
                   "and the files after it hold only empty or constant scalar grids; choose with --grid");
}

class VdbSeries : public InputSeries {
 public:
  VdbSeries(std::vector<StepFile> steps, const std::string& grid) {
    steps_ = std::move(steps);
    gridName_ = grid.empty() ? defaultGrid(steps_) : grid;
    for (size_t i = 0; i < steps_.size(); ++i) addStep(i);
  }

  Field read(size_t index) const override {
    const InputFile file(steps_.at(index).path);
    ByteReader reader(file);
    const VdbContainer container = readVdbContainer(reader);
    const VdbGridHeader& grid = gridOf(container, index);
    requireUsable(file.path(), grid);
    requireSame(grid, index);
    Field field = readGrid(file, grid);
    if (!lattice_.domain.contains(field.bounds))
      throw InputError(file.path(), "grid \"" + gridName_ +
                                        "\" has values outside the bounding box of its active voxels "
                                        "that its metadata state (file_bbox_min, file_bbox_max)");
    return field;
  }

  uint64_t bytes(size_t index) const override { return bytes_.at(index); }

 private:
  void addStep(size_t index) {
    const InputFile file(steps_[index].path);
    ByteReader reader(file);
    const VdbContainer container = readVdbContainer(reader);
    const VdbGridHeader& grid = gridOf(container, index);
    requireUsable(file.path(), grid);
    if (index == 0) {
      typeName_ = grid.typeName;
      lattice_.type = elementTypeOf(*grid.type());
      lattice_.background = backgroundAs(lattice_.type, grid.background);
      lattice_.worldFromIndex = *grid.transform;
    }
    requireSame(grid, index);
    lattice_.domain = unite(lattice_.domain, boundsOf(file, grid));
    bytes_.push_back(grid.end - grid.treeBegin);
  }

  const VdbGridHeader& gridOf(const VdbContainer& container, size_t index) const {
    if (const VdbGridHeader* grid = container.find(gridName_)) return *grid;
    const std::string& path = steps_[index].path;
    if (container.find(gridName_ + "[0]"))
      throw InputError(path, "holds several grids called \"" + gridName_ + "\": " + container.gridList());
    throw InputError(path, "has no grid \"" + gridName_ + "\"; it holds " + container.gridList());
  }

  void requireSame(const VdbGridHeader& grid, size_t index) const {
    const auto differ = [&](const std::string& what, const std::string& found, const std::string& expected) {
      throw InputError(steps_[index].path,
                       "step " + std::to_string(steps_[index].step) + " has " + what + " " + found +
                           " where step " + std::to_string(steps_[0].step) + " has " + expected +
                           "; steps that do not share it cannot be registered with each other");
    };
    const Affine &m = *grid.transform, &first = lattice_.worldFromIndex;
    if (grid.typeName != typeName_)
      differ("grid type", grid.type()->valueName, findVdbGridType(typeName_)->valueName);
    if (!nearlyEqual(first, m)) {
      const Vec3d size = voxelSizeOf(m), firstSize = voxelSizeOf(first);
      if (!nearlyEqual(firstSize, size, length(firstSize))) differ("voxel size", text(size), text(firstSize));
      if (!(first.translation == m.translation))
        differ("its origin at", text(m.translation), text(first.translation));
      differ("voxel axes", text(m.column[0]) + " ...", text(first.column[0]) + " ...");
    }
    if (backgroundAs(lattice_.type, grid.background) != lattice_.background)
      differ("background", text(grid.background), text(lattice_.background));
  }

  // Metadata where there are any; they are about active voxels, but a file that keeps others outside them is
  // refused when it is read.
  static VoxelBox boundsOf(const InputFile& file, const VdbGridHeader& grid) {
    const auto stated = grid.activeBounds();
    if (!stated) return readGrid(file, grid).bounds;
    constexpr int32_t kFarthest = 1 << 30;
    const VoxelBox far{{-kFarthest, -kFarthest, -kFarthest}, {kFarthest, kFarthest, kFarthest}};
    if (!far.contains(*stated)) throw InputError(file.path(), "states a bounding box outside +-2^30 voxels");
    return *stated;
  }

  std::string typeName_;
  std::vector<uint64_t> bytes_;
};

}  // namespace

std::unique_ptr<InputSeries> openVdbSeries(std::vector<StepFile> steps, const std::string& grid) {
  return std::make_unique<VdbSeries>(std::move(steps), grid);
}

}  // namespace kairos
