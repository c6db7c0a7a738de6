// Where two images differ, as a picture.
#pragma once

#include <string>

#include "core/image.h"

namespace kairos {

/// The errors that the map's darkest and brightest colours stand for.
constexpr double kLeastMappedError = 1e-4, kMostMappedError = 1;
/// Colours in between, equal ratios apart.
constexpr int kErrorLevels = 16;

/// The largest difference of each pixel's channels on a logarithmic scale; black where both are equal. Images
/// of 4 channels and equal sizes.
Image errorMap(const Image& image, const Image& exact);

/// The colour of a level from 0 to kErrorLevels - 1, for a legend: "#rrggbb".
std::string errorLevelColour(int level);

}  // namespace kairos
