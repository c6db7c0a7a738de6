// The best first, nearly: a priority queue by powers of the square root of two.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace kairos {

/// Items come out in order of priority, those within a factor of sqrt(2) in the order they were put in last.
/// Constant time a step; what comes out depends on nothing but what was put in.
template <class Item>
class BlockQueue {
 public:
  /// `priority` is finite and not negative.
  void push(float priority, const Item& item) {
    const size_t bucket = std::bit_cast<uint32_t>(priority) >> kShift;
    buckets_[bucket].push_back(item);
    highest_ = std::max(highest_, bucket);
    ++size_;
  }
  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }

  const Item& top() {
    while (buckets_[highest_].empty()) --highest_;
    return buckets_[highest_].back();
  }
  Item pop() {
    const Item item = top();
    buckets_[highest_].pop_back();
    --size_;
    return item;
  }
  void clear() {
    for (std::vector<Item>& bucket : buckets_) bucket.clear();
    size_ = highest_ = 0;
  }

 private:
  static constexpr int kShift = 22;  // sign, exponent and the first bit of the mantissa remain
  std::array<std::vector<Item>, (0x80000000u >> kShift)> buckets_;
  size_t highest_ = 0, size_ = 0;
};

}  // namespace kairos
