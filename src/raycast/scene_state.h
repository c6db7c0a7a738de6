// The volume of the current time step, and what casting rays through it takes: the state that all methods of
// rendering share.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "raycast/occupancy.h"
#include "raycast/render_settings.h"
#include "raycast/tile_kernel.h"
#include "volume/brick_volume.h"

namespace kairos {

/// What one step's changes did to the bricks. Entry i of each span belongs to cells[i].
struct AppliedChanges {
  std::span<const uint32_t> cells;         // ascending
  std::span<const uint64_t> subBlocks;     // which sub-blocks received new values
  std::span<const uint8_t> visibleBefore;  // was the brick visible before the step?
};

/// A volume under one transfer function. Reading is safe from several threads; `start` and `apply` are not
/// concurrent with it.
class SceneState {
 public:
  /// An empty volume; it has the brick grid of every later step. Throws OptionError for settings out of
  /// range.
  SceneState(const Lattice& lattice, const RenderSettings& settings, ThreadPool& pool);
  SceneState(const SceneState&) = delete;
  SceneState& operator=(const SceneState&) = delete;

  /// Takes a whole step. Throws StateError when it does not fit the lattice; nothing has changed then.
  void start(const Field& field);
  /// Applies one step's changes. The result is valid until the next call. Throws StateError when the changes
  /// belong to another state (or come before any whole step), or touch voxels outside the domain; nothing has
  /// changed then.
  AppliedChanges apply(const ChangedVoxels& changes);

  const Lattice& lattice() const { return lattice_; }
  const RenderSettings& settings() const { return settings_; }
  const ClassificationTable& table() const { return table_; }
  const BrickVolume& volume() const { return *volume_; }
  ThreadPool& pool() const { return pool_; }

  // Valid after `start`.
  const Occupancy& occupancy() const { return *occupancy_; }
  const SlabLevels& slabLevels() const { return *levels_; }
  const KernelScene& kernelScene() const { return kernelScene_; }
  TileKernel kernel() const { return kernel_; }
  /// Checksum of the state, where known.
  std::optional<uint64_t> checksum() const { return checksum_; }

 private:
  const Lattice lattice_;
  const RenderSettings settings_;
  ThreadPool& pool_;
  ClassificationTable table_;
  std::unique_ptr<BrickVolume> volume_;
  std::unique_ptr<Occupancy> occupancy_;
  std::unique_ptr<SlabLevels> levels_;
  KernelScene kernelScene_{};
  TileKernel kernel_ = nullptr;
  std::optional<uint64_t> checksum_;
  std::vector<uint8_t> visibleBefore_, levelChanged_;
  std::vector<uint64_t> changedSubBlocks_;
};

}  // namespace kairos
