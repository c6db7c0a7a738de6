#include "core/image_difference.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/image_size_check.h"
#include "core/ssim.h"

namespace kairos {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string sizeOf(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

double meanOf(const Image& map) {
  double sum = 0;
  for (float v : map.data) sum += v;
  return map.data.empty() ? 0 : sum / double(map.data.size());
}

}  // namespace

void requireComparable(const Image& a, const Image& b) {
  for (const Image& image : {std::cref(a), std::cref(b)})
    if (image.channels != 4)
      throw OptionError("compare",
                        "found an image of " + std::to_string(image.channels) + " channels, expected 4");
  if (a.width != b.width || a.height != b.height)
    throw OptionError("compare",
                      "found images of " + sizeOf(a) + " and " + sizeOf(b) + " pixels, expected equal sizes");
}

// A difference that is no number (NaN, or of two infinities) is an infinite one: a broken image never passes.
ColourError colourError(const Image& a, const Image& b) {
  requireComparable(a, b);
  double sum = 0, max = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    const double d = std::abs(double(a.data[i]) - double(b.data[i]));
    if (!std::isfinite(d)) return {kInfinity, kInfinity};
    sum += d * d;
    max = std::max(max, d);
  }
  return {a.data.empty() ? 0 : std::sqrt(sum / double(a.data.size())), max};
}

double psnrOf(double rmse) {
  return -20 * std::log10(rmse);
}

ImageDifference compareImages(const Image& a, const Image& b) {
  const ColourError errors = colourError(a, b);
  ImageDifference difference;
  difference.rmse = errors.rmse;
  difference.max = errors.max;
  difference.psnr = psnrOf(errors.rmse);
  difference.ssim = meanSsim(a, b);
  difference.flip = meanOf(flipMap(a, b));
  return difference;
}

}  // namespace kairos
