// Cached partials of a view's segments, and which of them a change has made stale.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "raycast/segment_index.h"

namespace kairos {

/// Partials stand at a fixed place per segment in memory that the operating system provides page by page as
/// it is first written, so invisible segments cost none, and count for none. A tile is cast through the cache
/// (its segments' fresh partials are valid) only while the total stays within the limit.
class SegmentCache {
 public:
  enum Flag : uint8_t {
    fresh = 0,    // the partial is the segment's
    stale = 1,    // it has to be integrated before it can be used
    touched = 2,  // stale, and by this step's changes
  };

  SegmentCache(const SegmentIndex& index, int tileCount, int channels, uint64_t limitBytes);

  float* partials(size_t firstSegment) const { return partials_.get() + firstSegment * stride_; }
  uint8_t* flags(size_t firstSegment) { return flags_.data() + firstSegment; }

  /// Marks one segment; true when it was not touched before in this step. Different segments may be marked at
  /// once.
  bool touch(size_t segment) {
    const bool first = flags_[segment] != touched;
    flags_[segment] = touched;
    return first;
  }

  /// Makes every segment stale.
  void invalidate() { std::fill(flags_.begin(), flags_.end(), uint8_t(stale)); }
  /// Turns this step's marks into plain stale ones.
  static void forgetMarks(uint8_t* flags, size_t segments) {
    std::replace(flags, flags + segments, uint8_t(touched), uint8_t(stale));
  }

  /// May the partials of so many of this tile's segments be kept? Reserves what they take beyond what the
  /// tile has.
  bool reserve(int tile, size_t segments);
  uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

 private:
  struct Free {
    void operator()(float* p) const;
  };
  size_t stride_;
  uint64_t limit_;
  std::unique_ptr<float[], Free> partials_;
  std::vector<uint8_t> flags_;
  std::vector<uint32_t> reserved_;  // segments, per tile
  std::atomic<uint64_t> bytes_{0};
};

}  // namespace kairos
