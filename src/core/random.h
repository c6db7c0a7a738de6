// Reproducible random numbers: the same seed gives the same numbers on every machine.
#pragma once

#include <cstdint>

namespace kairos {

/// splitmix64 (Steele, Lea and Flood 2014): 64 uniform bits a call, a period of 2^64, any seed is good.
class RandomBits {
 public:
  explicit RandomBits(uint64_t seed) : state_(seed) {}

  uint64_t next() {
    uint64_t x = state_ += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  }

  /// Uniform in [0, n), without bias (Lemire 2019); n > 0.
  uint64_t below(uint64_t n) {
    for (;;) {
      const auto product = static_cast<unsigned __int128>(next()) * n;
      const auto low = uint64_t(product);
      if (low >= n || low >= (0 - n) % n) return uint64_t(product >> 64);
    }
  }

  /// Uniform in [0, 1), 53 bits.
  double unit() { return double(next() >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

}  // namespace kairos
