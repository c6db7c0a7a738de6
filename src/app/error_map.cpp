#include "app/error_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/text_format.h"
#include "core/colour_map.h"
#include "core/srgb.h"

namespace kairos {
namespace {

// Linear.
const std::array<Vec3d, kErrorLevels>& levelColours() {
  static const std::array<Vec3d, kErrorLevels> colours = [] {
    const TransferFunction map = builtInTransferFunction("inferno");
    std::array<Vec3d, kErrorLevels> levels{};
    for (size_t i = 0; i < kErrorLevels; ++i) levels[i] = map.colour(double(i + 1) / kErrorLevels);
    return levels;
  }();
  return colours;
}

int levelOf(double error) {
  const double t = std::log(error / kLeastMappedError) / std::log(kMostMappedError / kLeastMappedError);
  return int(std::clamp(t * kErrorLevels, 0.0, kErrorLevels - 1.0));
}

}  // namespace

Image errorMap(const Image& image, const Image& exact) {
  Image map(image.width, image.height, 4);
  for (size_t p = 0; p < map.data.size(); p += 4) {
    double error = 0;
    for (size_t c = p; c < p + 4; ++c)
      error = std::max(error, std::abs(double(image.data[c]) - double(exact.data[c])));
    map.data[p + 3] = 1;
    if (error == 0) continue;
    const Vec3d& colour = levelColours()[size_t(levelOf(error))];
    for (int axis = 0; axis < 3; ++axis) map.data[p + size_t(axis)] = float(colour[axis]);
  }
  return map;
}

std::string errorLevelColour(int level) {
  std::string text = "#";
  for (int axis = 0; axis < 3; ++axis) {
    const double linear = std::clamp(levelColours()[size_t(level)][axis], 0.0, 1.0);
    text += formatted("%02x", int(std::lround(255 * srgbFromLinear(linear))));
  }
  return text;
}

}  // namespace kairos
