#include "lod/texture_pool.h"

#include <epoxy/gl.h>

#include "lod/gl_context.h"

namespace kairos {

TexturePool::TexturePool(TexelFormat format, uint64_t byteBudget)
    : format_(format), byteBudget_(byteBudget) {}

uint64_t TexturePool::bytesOf(const Vec3i& size) const {
  return uint64_t(size.x) * uint64_t(size.y) * uint64_t(size.z) * uint64_t(bytesPerTexel(format_));
}

unsigned TexturePool::acquire(uint64_t key, const Vec3i& size) {
  if (const auto found = entries_.find(key); found != entries_.end()) {
    order_.splice(order_.begin(), order_, found->second);
    return found->second->texture.id();
  }
  const uint64_t needed = bytesOf(size);
  if (needed > byteBudget_)
    throw GlError("a texture of " + std::to_string(needed) + " bytes does not fit the texture memory of " +
                  std::to_string(byteBudget_) + " bytes");
  GlObject texture;
  while (!order_.empty() && bytes_ + needed > byteBudget_) {
    Entry& last = order_.back();
    if (last.size == size) texture = std::move(last.texture);
    evict(last.key);
  }
  counters_.reused += texture.id() != 0;
  if (!texture.id()) texture = create(size);
  order_.push_front({key, size, std::move(texture)});
  entries_[key] = order_.begin();
  bytes_ += needed;
  return order_.front().texture.id();
}

GlObject TexturePool::create(const Vec3i& size) {
  GlObject texture = makeTexture();
  glBindTexture(GL_TEXTURE_3D, texture.id());
  const bool r16 = format_ == TexelFormat::r16;
  glTexImage3D(GL_TEXTURE_3D, 0, r16 ? GL_R16 : GL_R32F, size.x, size.y, size.z, 0, GL_RED,
               r16 ? GL_UNSIGNED_SHORT : GL_FLOAT, nullptr);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(GL_TEXTURE_3D, axis, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  checkGl("creating a texture");
  ++counters_.created;
  return texture;
}

void TexturePool::upload(uint64_t key, const VoxelBox& box, const void* texels) {
  const Vec3i size = box.size();
  glBindTexture(GL_TEXTURE_3D, entries_.at(key)->texture.id());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage3D(GL_TEXTURE_3D, 0, box.lo.x, box.lo.y, box.lo.z, size.x, size.y, size.z, GL_RED,
                  format_ == TexelFormat::r16 ? GL_UNSIGNED_SHORT : GL_FLOAT, texels);
  checkGl("uploading a texture");
  ++counters_.uploads;
  counters_.bytesUploaded += bytesOf(size);
}

void TexturePool::evict(uint64_t key) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return;
  bytes_ -= bytesOf(found->second->size);
  order_.erase(found->second);
  entries_.erase(found);
  ++counters_.evicted;
}

void TexturePool::clear() {
  while (!order_.empty()) evict(order_.front().key);
}

}  // namespace kairos
