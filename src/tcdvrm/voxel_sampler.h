// Drawing changed voxels at random, each once, without sorting them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/random.h"

namespace kairos {

/// Draws 0 ... count - 1 in uniformly random order: Fisher and Yates' shuffle, carried only as far as numbers
/// are asked for. A draw takes constant time, and so does a restart for every number drawn before.
class UniformSampler {
 public:
  void restart(uint64_t count, uint64_t seed);
  uint64_t remaining() const { return count_ - drawn_; }
  /// Only while some remain.
  uint64_t next();

 private:
  uint64_t at(uint64_t place) const { return places_[place] ? places_[place] - 1 : place; }

  RandomBits random_{0};
  uint64_t count_ = 0, drawn_ = 0;
  std::vector<uint64_t> places_;   // 1 + the number moved to a place; 0: its own
  std::vector<uint64_t> touched_;  // places to be cleared
};

/// Draws item numbers such that each next one is proportional to its weight among those left: an item of
/// twice the weight is twice as likely to come next. Weights of 0 count as 1.
class WeightedSampler {
 public:
  void restart(std::span<const uint16_t> weights, uint64_t seed);
  uint64_t remaining() const { return remaining_; }
  /// Only while some remain.
  uint64_t next();

 private:
  void compact();

  RandomBits random_{0};
  uint64_t remaining_ = 0, remainingWeight_ = 0;
  // Items that were left at the last `compact`, their weights summed up to and including each, and which of
  // them were drawn since. Drawn ones are drawn again, to no effect, until they make up half the weight.
  std::vector<uint64_t> items_, sums_;
  std::vector<uint8_t> drawn_;
};

}  // namespace kairos
