// Separable filters over single-channel images, for the image metrics.
#pragma once

#include <cstddef>
#include <vector>

namespace kairos {

/// One channel, rows top to bottom.
template <class Real>
struct Plane {
  int width = 0, height = 0;
  std::vector<Real> data;

  Plane() = default;
  Plane(int w, int h) : width(w), height(h), data(size_t(w) * size_t(h)) {}
  Real* row(int y) { return data.data() + size_t(y) * size_t(width); }
  const Real* row(int y) const { return data.data() + size_t(y) * size_t(width); }
};

/// Weights at offsets -radius ... radius.
template <class Real>
using Kernel = std::vector<Real>;

/// exp(-x^2 / (2 sigma^2)) at integer offsets, normalised to sum 1.
template <class Real>
Kernel<Real> gaussianKernel(double sigma, int radius);

/// Correlation (no mirroring of the kernel) along rows and along columns; the image's border pixels repeat
/// outwards.
template <class Real>
Plane<Real> filterRows(const Plane<Real>& in, const Kernel<Real>& kernel);
template <class Real>
Plane<Real> filterColumns(const Plane<Real>& in, const Kernel<Real>& kernel);

extern template Kernel<float> gaussianKernel(double, int);
extern template Kernel<double> gaussianKernel(double, int);
extern template Plane<float> filterRows(const Plane<float>&, const Kernel<float>&);
extern template Plane<double> filterRows(const Plane<double>&, const Kernel<double>&);
extern template Plane<float> filterColumns(const Plane<float>&, const Kernel<float>&);
extern template Plane<double> filterColumns(const Plane<double>&, const Kernel<double>&);

}  // namespace kairos
