#include "core/image_filter.h"

#include <algorithm>
#include <cmath>

namespace kairos {
namespace {

template <class Real>
int radiusOf(const Kernel<Real>& kernel) {
  return int(kernel.size() / 2);
}

// out += weight * in; the one loop where the time goes, kept simple for the vectoriser.
template <class Real>
void addScaled(Real* __restrict out, const Real* __restrict in, Real weight, int count) {
  for (int i = 0; i < count; ++i) out[i] += weight * in[i];
}

}  // namespace

template <class Real>
Kernel<Real> gaussianKernel(double sigma, int radius) {
  std::vector<double> weights;
  double sum = 0;
  for (int x = -radius; x <= radius; ++x) {
    weights.push_back(std::exp(-double(x) * x / (2 * sigma * sigma)));
    sum += weights.back();
  }
  Kernel<Real> kernel;
  for (double w : weights) kernel.push_back(Real(w / sum));
  return kernel;
}

template <class Real>
Plane<Real> filterRows(const Plane<Real>& in, const Kernel<Real>& kernel) {
  const int radius = radiusOf(kernel);
  Plane<Real> out(in.width, in.height);
  std::vector<Real> padded(size_t(in.width) + 2 * size_t(radius));
  for (int y = 0; y < in.height; ++y) {
    const Real* row = in.row(y);
    std::fill_n(padded.begin(), radius, row[0]);
    std::copy_n(row, in.width, padded.begin() + radius);
    std::fill_n(padded.begin() + radius + in.width, radius, row[in.width - 1]);
    for (size_t k = 0; k < kernel.size(); ++k) addScaled(out.row(y), padded.data() + k, kernel[k], in.width);
  }
  return out;
}

template <class Real>
Plane<Real> filterColumns(const Plane<Real>& in, const Kernel<Real>& kernel) {
  const int radius = radiusOf(kernel);
  Plane<Real> out(in.width, in.height);
  for (int y = 0; y < in.height; ++y)
    for (int k = -radius; k <= radius; ++k)
      addScaled(out.row(y), in.row(std::clamp(y + k, 0, in.height - 1)), kernel[size_t(k + radius)],
                in.width);
  return out;
}

template Kernel<float> gaussianKernel(double, int);
template Kernel<double> gaussianKernel(double, int);
template Plane<float> filterRows(const Plane<float>&, const Kernel<float>&);
template Plane<double> filterRows(const Plane<double>&, const Kernel<double>&);
template Plane<float> filterColumns(const Plane<float>&, const Kernel<float>&);
template Plane<double> filterColumns(const Plane<double>&, const Kernel<double>&);

}  // namespace kairos
