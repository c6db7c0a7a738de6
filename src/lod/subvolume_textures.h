// The textures of a volume's subvolumes: loaded when needed, brought up to date where they are stale.
#pragma once

#include <cstdint>
#include <vector>

#include "lod/boundary_copy.h"
#include "lod/lod_volume.h"
#include "lod/texture_pool.h"

namespace kairos {

class SubvolumeTextures {
 public:
  /// The volume must outlive this.
  SubvolumeTextures(const LodVolume& volume, uint64_t byteBudget);

  /// Would `bind` have nothing to load? (The R of Li and Shen 2002, 4.2.1.)
  bool resident(const SubvolumeLevels& levels, uint32_t i) const;
  /// Binds subvolume i's texture at levels[i] to the active texture unit, its faces adapted to its
  /// neighbours. Returns how many voxels had to be loaded for that.
  uint64_t bind(const SubvolumeLevels& levels, uint32_t i);

  /// After a change of the volume: the textures that hold what changed are out of date there, the others stay
  /// as they are.
  void markStale(const DirtyBlocks& blocks);

  const TexturePoolCounters& counters() const { return pool_.counters(); }
  uint64_t bytes() const { return pool_.bytes(); }
  /// The value that a texel of 1 stands for.
  float valueScale() const { return valueScale_; }

  static TexelFormat formatFor(ElementType type) {
    return type == ElementType::f32 ? TexelFormat::r32f : TexelFormat::r16;
  }

 private:
  struct Content {
    bool loaded = false;  // does the pool hold it?
    uint64_t signature = 0;
    VoxelBox stale;
  };

  uint64_t keyOf(uint32_t i, int level) const { return uint64_t(i) * uint64_t(levels_) + uint64_t(level); }
  uint64_t keyOf(const SubvolumeLevels& levels, uint32_t i) const { return keyOf(i, levels[i]); }
  void noteEvictions();
  void load(uint64_t key, const SubvolumeLevels& levels, uint32_t i, const VoxelBox& box);

  const LodVolume& volume_;
  float valueScale_;
  TexturePool pool_;
  int levels_;                     // of the pyramid
  std::vector<Content> contents_;  // by key; asked for all levels of all subvolumes in every frame
  std::vector<float> texels_;
  std::vector<float> floats_;
  std::vector<uint16_t> integers_;
};

}  // namespace kairos
