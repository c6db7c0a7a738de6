// The 3D textures that stand in texture memory: a byte budget, least recently used out first, objects reused.
#pragma once

#include <cstdint>
#include <list>
#include <unordered_map>

#include "core/box.h"
#include "core/vec3.h"
#include "lod/gl_objects.h"

namespace kairos {

/// One channel of 32-bit float, or of 16-bit normalised integer (8-bit ones are filtered in 8-bit fixed point
/// by some drivers).
enum class TexelFormat { r16, r32f };
constexpr int bytesPerTexel(TexelFormat format) {
  return format == TexelFormat::r16 ? 2 : 4;
}

/// What the pool has done since it was made.
struct TexturePoolCounters {
  uint64_t uploads = 0, bytesUploaded = 0;
  uint64_t created = 0, reused = 0, evicted = 0;
};

/// glAreTexturesResident says "yes" on every current driver, so residency is decided here: a texture is
/// resident when the pool holds it.
class TexturePool {
 public:
  /// Textures together never take more than `byteBudget`.
  TexturePool(TexelFormat format, uint64_t byteBudget);

  TexelFormat format() const { return format_; }
  uint64_t byteBudget() const { return byteBudget_; }
  uint64_t bytes() const { return bytes_; }
  uint64_t bytesOf(const Vec3i& size) const;
  const TexturePoolCounters& counters() const { return counters_; }

  bool resident(uint64_t key) const { return entries_.count(key) != 0; }

  /// The GL texture of `key`, most recently used from now on. Where it is not resident, textures are evicted
  /// until there is room, and an evicted one of equal size is used again instead of a new one; its content
  /// is then undefined until `upload`. Valid until the next `acquire`. Throws GlError when `size` alone
  /// exceeds the budget.
  unsigned acquire(uint64_t key, const Vec3i& size);
  /// Replaces the texels of `box` (within the texture's size) of a resident texture, x fastest, by
  /// glTexSubImage3D. `texels` are of the pool's format.
  void upload(uint64_t key, const VoxelBox& box, const void* texels);
  void evict(uint64_t key);
  void clear();

 private:
  struct Entry {
    uint64_t key;
    Vec3i size;
    GlObject texture;
  };
  using Entries = std::list<Entry>;  // most recently used first

  GlObject create(const Vec3i& size);

  TexelFormat format_;
  uint64_t byteBudget_, bytes_ = 0;
  Entries order_;
  std::unordered_map<uint64_t, Entries::iterator> entries_;
  TexturePoolCounters counters_;
};

}  // namespace kairos
