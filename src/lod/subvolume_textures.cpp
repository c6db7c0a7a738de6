#include "lod/subvolume_textures.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace kairos {

SubvolumeTextures::SubvolumeTextures(const LodVolume& volume, uint64_t byteBudget)
    : volume_(volume),
      valueScale_(volume.lattice().type == ElementType::u8    ? 255.0f
                  : volume.lattice().type == ElementType::u16 ? 65535.0f
                                                              : 1.0f),
      pool_(formatFor(volume.lattice().type), byteBudget),
      levels_(volume.pyramid().levels()),
      contents_(volume.subdivision().size() * size_t(levels_)) {}

bool SubvolumeTextures::resident(const SubvolumeLevels& levels, uint32_t i) const {
  const Content& content = contents_[keyOf(levels, i)];
  return content.loaded && content.stale.empty() &&
         content.signature == boundarySignature(volume_.subdivision(), levels, i);
}

uint64_t SubvolumeTextures::bind(const SubvolumeLevels& levels, uint32_t i) {
  const uint64_t key = keyOf(levels, i);
  const Vec3i size = volume_.subdivision().subvolumes()[i].vertices(levels[i]);
  const uint64_t evicted = pool_.counters().evicted;
  const unsigned texture = pool_.acquire(key, size);
  if (pool_.counters().evicted != evicted) noteEvictions();
  const uint64_t signature = boundarySignature(volume_.subdivision(), levels, i);
  Content& content = contents_[key];
  VoxelBox box = content.stale;
  if (!content.loaded || content.signature != signature) box = {{0, 0, 0}, size};
  if (!box.empty()) load(key, levels, i, box);
  content = {true, signature, {}};
  glBindTexture(GL_TEXTURE_3D, texture);
  return uint64_t(box.voxelCount());
}

void SubvolumeTextures::noteEvictions() {
  for (uint64_t key = 0; key < contents_.size(); ++key)
    if (!pool_.resident(key)) contents_[key] = {};
}

void SubvolumeTextures::load(uint64_t key, const SubvolumeLevels& levels, uint32_t i, const VoxelBox& box) {
  copyTexels(volume_.pyramid(), volume_.subdivision(), levels, i, texels_);
  const Vec3i size = volume_.subdivision().subvolumes()[i].vertices(levels[i]);
  if (pool_.format() == TexelFormat::r32f && box.size() == size)
    return pool_.upload(key, box, texels_.data());
  floats_.clear();
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y) {
      const auto row = texels_.begin() + (int64_t(z) * size.y + y) * size.x;
      floats_.insert(floats_.end(), row + box.lo.x, row + box.hi.x);
    }
  if (pool_.format() == TexelFormat::r32f) {
    pool_.upload(key, box, floats_.data());
    return;
  }
  const float scale = 65535.0f / valueScale_;
  integers_.resize(floats_.size());
  std::transform(floats_.begin(), floats_.end(), integers_.begin(),
                 [scale](float v) { return uint16_t(std::lround(v * scale)); });
  pool_.upload(key, box, integers_.data());
}

// A face's values may come from a coarser neighbour, so a level is stale too where a coarser one changed.
void SubvolumeTextures::markStale(const DirtyBlocks& blocks) {
  const auto& subvolumes = volume_.subdivision().subvolumes();
  for (uint32_t i = 0; i < subvolumes.size(); ++i)
    for (int level = 0; level < subvolumes[i].levels; ++level) {
      Content& content = contents_[keyOf(i, level)];
      if (!content.loaded) continue;
      content.stale = unite(content.stale, dirtyVertices(subvolumes[i], level, blocks.levels[size_t(level)]));
      if (content.signature == 0) continue;
      for (size_t coarser = size_t(level) + 1; coarser < blocks.levels.size(); ++coarser) {
        VoxelBox around = dirtyVertices(subvolumes[i], int(coarser), blocks.levels[coarser]);
        if (around.empty()) continue;
        const int shift = int(coarser) - level;
        const Vec3i one{1, 1, 1}, size = subvolumes[i].vertices(level);
        around.lo = componentMax((around.lo - one) * (1 << shift), {0, 0, 0});
        around.hi = componentMin((around.hi + one) * (1 << shift), size);
        content.stale = unite(content.stale, around);
      }
    }
}

}  // namespace kairos
