#include "tcdvrm/voxel_sampler.h"

#include <algorithm>

namespace kairos {

void UniformSampler::restart(uint64_t count, uint64_t seed) {
  for (const uint64_t place : touched_) places_[place] = 0;
  touched_.clear();
  if (places_.size() < count) places_.resize(count);
  random_ = RandomBits(seed);
  count_ = count;
  drawn_ = 0;
}

uint64_t UniformSampler::next() {
  const uint64_t place = drawn_ + random_.below(remaining());
  const uint64_t number = at(place);
  places_[place] = at(drawn_) + 1;
  touched_.push_back(place);
  ++drawn_;
  return number;
}

void WeightedSampler::restart(std::span<const uint16_t> weights, uint64_t seed) {
  random_ = RandomBits(seed);
  items_.resize(weights.size());
  sums_.resize(weights.size());
  drawn_.assign(weights.size(), 0);
  uint64_t sum = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    items_[i] = i;
    sums_[i] = sum += std::max<uint16_t>(weights[i], 1);
  }
  remaining_ = weights.size();
  remainingWeight_ = sum;
}

uint64_t WeightedSampler::next() {
  if (2 * remainingWeight_ < sums_.back()) compact();
  for (;;) {
    const uint64_t at = random_.below(sums_.back());
    const auto place = size_t(std::upper_bound(sums_.begin(), sums_.end(), at) - sums_.begin());
    if (drawn_[place]) continue;
    drawn_[place] = 1;
    remainingWeight_ -= sums_[place] - (place ? sums_[place - 1] : 0);
    --remaining_;
    return items_[place];
  }
}

void WeightedSampler::compact() {
  size_t kept = 0;
  uint64_t sum = 0, before = 0;
  for (size_t i = 0; i < items_.size(); ++i) {
    const uint64_t weight = sums_[i] - before;
    before = sums_[i];
    if (drawn_[i]) continue;
    items_[kept] = items_[i];
    sums_[kept++] = sum += weight;
  }
  items_.resize(kept);
  sums_.resize(kept);
  drawn_.assign(kept, 0);
}

}  // namespace kairos
