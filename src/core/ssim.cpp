#include "core/ssim.h"

#include "core/image_filter.h"
#include "core/srgb.h"

namespace kairos {
namespace {

using PlaneD = Plane<double>;

constexpr int kRadius = 5;

PlaneD displayedLuma(const Image& image) {
  PlaneD luma(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.pixel(x, y);
      luma.row(y)[x] = 0.2126 * srgbFromLinear(displayed(p[0])) + 0.7152 * srgbFromLinear(displayed(p[1])) +
                       0.0722 * srgbFromLinear(displayed(p[2]));
    }
  return luma;
}

PlaneD product(const PlaneD& a, const PlaneD& b) {
  PlaneD p(a.width, a.height);
  for (size_t i = 0; i < p.data.size(); ++i) p.data[i] = a.data[i] * b.data[i];
  return p;
}

PlaneD windowMean(const PlaneD& plane) {
  static const Kernel<double> window = gaussianKernel<double>(1.5, kRadius);
  return filterColumns(filterRows(plane, window), window);
}

struct Moments {
  PlaneD meanA, meanB, meanAA, meanBB, meanAB;
};

double ssimAt(const Moments& m, size_t i) {
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  const double a = m.meanA.data[i], b = m.meanB.data[i];
  const double varianceA = m.meanAA.data[i] - a * a, varianceB = m.meanBB.data[i] - b * b;
  const double covariance = m.meanAB.data[i] - a * b;
  return (2 * a * b + c1) * (2 * covariance + c2) / ((a * a + b * b + c1) * (varianceA + varianceB + c2));
}

}  // namespace

double meanSsim(const Image& imageA, const Image& imageB) {
  const int width = imageA.width, height = imageA.height;
  if (width == 0 || height == 0) return 1;
  const PlaneD a = displayedLuma(imageA), b = displayedLuma(imageB);
  const Moments m{windowMean(a), windowMean(b), windowMean(product(a, a)), windowMean(product(b, b)),
                  windowMean(product(a, b))};
  const int border = width > 2 * kRadius && height > 2 * kRadius ? kRadius : 0;
  double sum = 0;
  for (int y = border; y < height - border; ++y)
    for (int x = border; x < width - border; ++x) sum += ssimAt(m, size_t(y) * size_t(width) + size_t(x));
  return sum / (double(width - 2 * border) * (height - 2 * border));
}

}  // namespace kairos
