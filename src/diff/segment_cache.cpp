#include "diff/segment_cache.h"

#include <sys/mman.h>

#include <new>

namespace kairos {
namespace {

// The mapping's size is kept in front of the partials, in a page of its own.
constexpr size_t kPage = 4096;

}  // namespace

void SegmentCache::Free::operator()(float* p) const {
  char* base = reinterpret_cast<char*>(p) - kPage;
  munmap(base, *reinterpret_cast<size_t*>(base));
}

SegmentCache::SegmentCache(const SegmentIndex& index, int tileCount, int channels, uint64_t limitBytes)
    : stride_(size_t(channels) * kLanes), limit_(limitBytes) {
  const size_t bytes = kPage + index.segmentCount() * stride_ * sizeof(float);
  // Address space only: pages come when first written, and never count where they are not.
  void* base =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (base == MAP_FAILED) throw std::bad_alloc();
  *static_cast<size_t*>(base) = bytes;
  partials_.reset(reinterpret_cast<float*>(static_cast<char*>(base) + kPage));
  flags_.assign(index.segmentCount(), stale);
  reserved_.assign(size_t(tileCount), 0);
}

bool SegmentCache::reserve(int tile, size_t segments) {
  uint32_t& reserved = reserved_[size_t(tile)];
  if (segments <= reserved) return true;
  const uint64_t more = (segments - reserved) * stride_ * sizeof(float);
  if (bytes_.fetch_add(more, std::memory_order_relaxed) + more > limit_) {
    bytes_.fetch_sub(more, std::memory_order_relaxed);
    return false;
  }
  reserved = uint32_t(segments);
  return true;
}

}  // namespace kairos
