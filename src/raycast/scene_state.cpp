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
  levels_ = std::make_unique<SlabLevels>(settings_, table_);
  levels_->build(*volume_, pool_);
  kernelScene_ = makeKernelScene(settings_, *volume_, table_, *occupancy_, *levels_);
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
  if (settings_.error == 0) return {dirty.cells, dirty.subBlocks, visibleBefore_};
  // Other slabs in a brick change all that lies in it.
  levels_->update(*volume_, dirty, pool_, levelChanged_);
  changedSubBlocks_ = dirty.subBlocks;
  for (size_t i = 0; i < changedSubBlocks_.size(); ++i)
    if (levelChanged_[i]) changedSubBlocks_[i] = ~uint64_t(0);
  return {dirty.cells, changedSubBlocks_, visibleBefore_};
}

}  // namespace kairos
