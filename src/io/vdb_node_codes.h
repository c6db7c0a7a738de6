// How OpenVDB stores the values of a node (io/Compression.h there).
#pragma once

#include <cstdint>

namespace kairos {

enum CompressionFlag : uint32_t { kZip = 1, kActiveMask = 2, kBlosc = 4 };

// How the inactive values of a node are stored: all of them the background; or all values stored; else by the
// functions below, those without a value of their own being the background or its negative.
inline constexpr int kBackground = 0, kAllValues = 6;
constexpr bool hasSelectionMask(int code) {
  return code >= 3 && code <= 5;
}
constexpr int inactiveValueCount(int code) {
  return code == 2 || code == 4 ? 1 : code == 5 ? 2 : 0;
}

}  // namespace kairos
