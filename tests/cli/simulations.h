// Small simulations as raw files, for the tests of the commands that read them.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "volume/field.h"

namespace kairos::test {

using Arguments = std::vector<std::string>;

inline Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline const Vec3i kDims{20, 17, 12};

/// A wave that drifts slowly and a corner where nothing ever happens. Floats have NaN and infinite voxels
/// that come and go.
template <class T>
std::vector<T> waveAt(int step, const Vec3i& dims = kDims) {
  std::vector<T> values;
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        const double wave = std::sin(0.4 * x + 0.3 * y + 0.05 * step) * std::cos(0.35 * z - 0.02 * step);
        values.push_back(T(x < 6 ? 0 : 100 + 90 * wave));
      }
  if constexpr (std::is_same_v<T, float>) {
    values[7] = step % 2 ? std::numeric_limits<float>::quiet_NaN() : 1;
    values[8] = std::numeric_limits<float>::quiet_NaN();
    values[9] = step % 3 ? std::numeric_limits<float>::infinity() : -std::numeric_limits<float>::infinity();
  }
  return values;
}

inline std::string rawName(int step) {
  const std::string digits = std::to_string(step);
  return "wave_" + std::string(4 - digits.size(), '0') + digits + ".raw";
}

template <class T>
void writeWaves(const std::string& directory, int first, int count, const Vec3i& dims = kDims) {
  for (int step = first; step < first + count; ++step)
    writeRawFile(directory + "/" + rawName(step), waveAt<T>(step, dims));
}

inline Arguments rawArguments(ElementType type, const Vec3i& dims = kDims) {
  return {"--dims", std::to_string(dims.x) + "," + std::to_string(dims.y) + "," + std::to_string(dims.z),
          "--type", std::string(name(type))};
}

}  // namespace kairos::test
