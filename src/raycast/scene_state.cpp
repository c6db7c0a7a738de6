#include "raycast/scene_state.h"

#include <string>

#include "core/error.h"

namespace kairos {
namespace {

Field emptyField(const Lattice& lattice) {
  Field empty;
  empty.background = lattice.background;
  empty.values = makeVoxelArray(lattice.type);
  return empty;
}

const RenderSettings& validated(const RenderSettings& settings) {
  settings.validate();
  return settings;
}

}  // namespace

SceneState::SceneState(const Lattice& lattice, const RenderSettings& settings, ThreadPool& pool)
    : lattice_(lattice),
      settings_(validated(settings)),
      pool_(pool),
      table_(settings_.classification(lattice_)),
      volume_(std::make_unique<BrickVolume>(lattice_, emptyField(lattice_), pool_)) {}

void SceneState::start(const Field& field) {
  volume_ = std::make_unique<BrickVolume>(lattice_, field, pool_);
  occupancy_ = std::make_unique<Occupancy>(settings_, table_);
  occupancy_->build(*volume_);
  kernelScene_ = makeKernelScene(settings_, *volume_, table_, *occupancy_);
  kernel_ = settings_.kernel == Kernel::general ? generalKernel(kernelScene_, settings_.isa)
                                                : fastestKernel(kernelScene_, settings_.isa);
  checksum_ = stateChecksum(field);
}

AppliedChanges SceneState::apply(const ChangedVoxels& changes) {
  if (!occupancy_) throw StateError("changes were applied before any whole step was rendered");
  if (checksum_ && changes.stateBefore && *checksum_ != *changes.stateBefore)
    throw StateError(
        "the changes belong to another state of the volume than the one shown: their checksum before is " +
        std::to_string(*changes.stateBefore) + ", the volume's is " + std::to_string(*checksum_));
  const DirtyBricks& dirty = volume_->apply(changes, pool_);
  checksum_ = changes.stateAfter;
  occupancy_->update(*volume_, dirty, visibleBefore_);
  return {dirty.cells, dirty.subBlocks, visibleBefore_};
}

}  // namespace kairos
