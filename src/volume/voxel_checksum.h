// The terms that a field's state checksum is the sum of (see stateChecksum), for loops over voxels.
#pragma once

#include <cstdint>

#include "core/vec3.h"

namespace kairos {

inline uint64_t splitmixFinaliser(uint64_t x) {  // Steele, Lea and Flood 2014
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// What a voxel's place contributes to its term.
inline uint64_t checksumOfPlace(const Vec3i& v) {
  constexpr uint64_t kGolden = 0x9e3779b97f4a7c15ull;
  return splitmixFinaliser((uint64_t(uint32_t(v.x)) | uint64_t(uint32_t(v.y)) << 32) ^
                           splitmixFinaliser(uint64_t(uint32_t(v.z)) + kGolden));
}

/// A voxel's term, by the checksum of its place.
inline uint64_t checksumTerm(uint64_t place, uint64_t valueBits, uint64_t backgroundBits) {
  constexpr uint64_t kGolden = 0x9e3779b97f4a7c15ull;
  return valueBits == backgroundBits ? 0 : splitmixFinaliser(place + valueBits * kGolden + 1);
}

}  // namespace kairos
