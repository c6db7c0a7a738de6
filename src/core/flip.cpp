// FLIP for low-dynamic-range images: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP:
// A Difference Evaluator for Alternating Images", HPG 2020. Constants and conventions are the authors'
// reference implementation's; its filters are products or sums of two products, so all passes here are
// one-dimensional.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/image_difference.h"
#include "core/image_filter.h"
#include "core/image_size_check.h"
#include "core/srgb.h"
#include "core/vec3.h"

namespace kairos {
namespace {

using PlaneF = Plane<float>;
using KernelF = Kernel<float>;

// A 0.7 m wide display of 3840 pixels seen from 0.7 m.
constexpr double kPixelsPerDegree = 0.7 * 3840 / 0.7 * std::numbers::pi / 180;

// ---- Colour spaces. Lab and YCxCz are relative to the white that linear RGB (1, 1, 1) maps to (D65).

constexpr Vec3d kWhite{0.950428545, 1.0, 1.088900371};

Vec3d relativeXyzFromRgb(const Vec3d& c) {
  return {(10135552.0 * c.x + 8788810.0 * c.y + 4435075.0 * c.z) / 24577794.0 / kWhite.x,
          (2613072.0 * c.x + 8788810.0 * c.y + 887015.0 * c.z) / 12288897.0,
          (1425312.0 * c.x + 8788810.0 * c.y + 70074185.0 * c.z) / 73733382.0 / kWhite.z};
}

Vec3d rgbFromRelativeXyz(const Vec3d& relative) {
  const double x = relative.x * kWhite.x, y = relative.y, z = relative.z * kWhite.z;
  return {3.241003275 * x - 1.537398934 * y - 0.498615861 * z,
          -0.969224334 * x + 1.875930071 * y + 0.041554224 * z,
          0.055639423 * x - 0.204011202 * y + 1.057148933 * z};
}

// The opponent transform that Lab and its linear counterpart YCxCz share.
Vec3d opponent(const Vec3d& v) {
  return {116 * v.y - 16, 500 * (v.x - v.y), 200 * (v.y - v.z)};
}

Vec3d relativeXyzFromYcxcz(const Vec3d& c) {
  const double y = (c.x + 16) / 116;
  return {y + c.y / 500, y, y - c.z / 200};
}

double labCompression(double t) {
  constexpr double delta = 6.0 / 29;
  return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
}

// Lab with chroma reduced in the dark (Hunt effect), in which colours are compared.
Vec3d huntLabFromRgb(const Vec3d& rgb) {
  const Vec3d xyz = relativeXyzFromRgb(rgb);
  const Vec3d lab = opponent({labCompression(xyz.x), labCompression(xyz.y), labCompression(xyz.z)});
  return {lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z};
}

double hyab(const Vec3d& a, const Vec3d& b) {
  const Vec3d d = a - b;
  return std::abs(d.x) + std::sqrt(d.y * d.y + d.z * d.z);
}

// ---- Contrast sensitivity: each opponent channel is blurred as the eye does.

struct WeightedGaussian {
  KernelF kernel;
  float weight;
};

// Sum of amplitude * sqrt(pi / scale) * exp(-pi^2 r^2 / scale), r in degrees, normalised over the square
// window.
template <size_t N>
std::array<WeightedGaussian, N> sensitivityFilter(
    const std::array<std::array<double, 2>, N>& amplitudeAndScale) {
  constexpr double kWidestScale = 0.04;
  const auto sigma = [](double scale) { return std::sqrt(scale / 2) / std::numbers::pi * kPixelsPerDegree; };
  const int radius = int(std::ceil(3 * sigma(kWidestScale)));
  std::array<WeightedGaussian, N> filter;
  double total = 0;
  for (size_t i = 0; i < N; ++i) {
    const auto [amplitude, scale] = amplitudeAndScale[i];
    const double centre =
        gaussianKernel<double>(sigma(scale), radius)[size_t(radius)];  // 1 / sum of the bare Gaussian
    const double weight = amplitude * std::sqrt(std::numbers::pi / scale) / (centre * centre);
    filter[i] = {gaussianKernel<float>(sigma(scale), radius), float(weight)};
    total += weight;
  }
  for (WeightedGaussian& g : filter) g.weight = float(g.weight / total);
  return filter;
}

template <size_t N>
PlaneF filtered(const PlaneF& in, const std::array<WeightedGaussian, N>& filter) {
  PlaneF out(in.width, in.height);
  for (const WeightedGaussian& g : filter) {
    const PlaneF blurred = filterColumns(filterRows(in, g.kernel), g.kernel);
    for (size_t i = 0; i < out.data.size(); ++i) out.data[i] += g.weight * blurred.data[i];
  }
  return out;
}

// ---- Features: edges and points are first and second derivatives of a Gaussian.

struct FeatureKernels {
  KernelF smooth, edge, point;
};

// Positive weights sum to 1, negative ones to -1.
KernelF balanced(KernelF kernel) {
  double positive = 0, negative = 0;
  for (float w : kernel) (w > 0 ? positive : negative) += std::abs(w);
  for (float& w : kernel) w = float(w / (w > 0 ? positive : negative));
  return kernel;
}

FeatureKernels featureKernels() {
  constexpr double kFeatureWidth = 0.082;  // degrees
  const double sigma = 0.5 * kFeatureWidth * kPixelsPerDegree;
  const int radius = int(std::ceil(3 * sigma));
  FeatureKernels k;
  k.smooth = gaussianKernel<float>(sigma, radius);
  for (int x = -radius; x <= radius; ++x) {
    const double g = std::exp(-x * x / (2 * sigma * sigma));
    k.edge.push_back(float(-x * g));
    k.point.push_back(float((x * x / (sigma * sigma) - 1) * g));
  }
  k.edge = balanced(k.edge);
  k.point = balanced(k.point);
  return k;
}

PlaneF magnitude(PlaneF x, const PlaneF& y) {
  for (size_t i = 0; i < x.data.size(); ++i)
    x.data[i] = std::sqrt(x.data[i] * x.data[i] + y.data[i] * y.data[i]);
  return x;
}

// ---- What FLIP compares of an image.

struct Perceived {
  PlaneF l, a, b;        // Hunt-adjusted Lab of the image as the eye resolves it
  PlaneF edges, points;  // feature strengths in the luminance
};

struct OpponentPlanes {
  PlaneF y, cx, cz;
};

OpponentPlanes opponentPlanes(const Image& image) {
  OpponentPlanes o{{image.width, image.height}, {image.width, image.height}, {image.width, image.height}};
  for (size_t i = 0; i < o.y.data.size(); ++i) {
    const float* p = image.data.data() + i * 4;
    const Vec3d c = opponent(relativeXyzFromRgb({displayed(p[0]), displayed(p[1]), displayed(p[2])}));
    o.y.data[i] = float(c.x);
    o.cx.data[i] = float(c.y);
    o.cz.data[i] = float(c.z);
  }
  return o;
}

void blurAndConvertToLab(const OpponentPlanes& opponentImage, Perceived& seen) {
  static const auto achromatic = sensitivityFilter<1>({{{1, 0.0047}}});
  static const auto redGreen = sensitivityFilter<1>({{{1, 0.0053}}});
  static const auto blueYellow = sensitivityFilter<2>({{{34.1, 0.04}, {13.5, 0.025}}});
  seen.l = filtered(opponentImage.y, achromatic);
  seen.a = filtered(opponentImage.cx, redGreen);
  seen.b = filtered(opponentImage.cz, blueYellow);
  for (size_t i = 0; i < seen.l.data.size(); ++i) {
    const Vec3d rgb =
        rgbFromRelativeXyz(relativeXyzFromYcxcz({seen.l.data[i], seen.a.data[i], seen.b.data[i]}));
    const Vec3d lab = huntLabFromRgb(
        {std::clamp(rgb.x, 0.0, 1.0), std::clamp(rgb.y, 0.0, 1.0), std::clamp(rgb.z, 0.0, 1.0)});
    seen.l.data[i] = float(lab.x);
    seen.a.data[i] = float(lab.y);
    seen.b.data[i] = float(lab.z);
  }
}

void detectFeatures(PlaneF luminance, Perceived& seen) {
  static const FeatureKernels k = featureKernels();
  for (float& y : luminance.data) y = (y + 16) / 116;
  const PlaneF smoothRows = filterRows(luminance, k.smooth);
  seen.edges =
      magnitude(filterColumns(filterRows(luminance, k.edge), k.smooth), filterColumns(smoothRows, k.edge));
  seen.points =
      magnitude(filterColumns(filterRows(luminance, k.point), k.smooth), filterColumns(smoothRows, k.point));
}

Perceived perceive(const Image& image) {
  OpponentPlanes planes = opponentPlanes(image);
  Perceived seen;
  blurAndConvertToLab(planes, seen);
  detectFeatures(std::move(planes.y), seen);
  return seen;
}

// ---- The errors.

double colourError(const Vec3d& a, const Vec3d& b) {
  constexpr double qc = 0.7, pc = 0.4, pt = 0.95;
  static const double largest = std::pow(hyab(huntLabFromRgb({0, 1, 0}), huntLabFromRgb({0, 0, 1})), qc);
  const double error = std::pow(hyab(a, b), qc), knee = pc * largest;
  if (error < knee) return pt / knee * error;
  return pt + (error - knee) / (largest - knee) * (1 - pt);
}

double errorAt(const Perceived& a, const Perceived& b, size_t i) {
  const double colour =
      colourError({a.l.data[i], a.a.data[i], a.b.data[i]}, {b.l.data[i], b.a.data[i], b.b.data[i]});
  const double edge = std::abs(a.edges.data[i] - b.edges.data[i]);
  const double point = std::abs(a.points.data[i] - b.points.data[i]);
  const double feature = std::sqrt(std::max(edge, point) / std::numbers::sqrt2);
  return std::pow(std::clamp(colour, 0.0, 1.0), 1 - feature);
}

bool hasNan(const float* rgba) {
  return std::isnan(rgba[0]) || std::isnan(rgba[1]) || std::isnan(rgba[2]);
}

}  // namespace

Image flipMap(const Image& a, const Image& b) {
  requireComparable(a, b);
  Image map(a.width, a.height, 1);
  if (map.data.empty()) return map;
  const Perceived seenA = perceive(a), seenB = perceive(b);
  for (size_t i = 0; i < map.data.size(); ++i) {
    const bool broken = hasNan(a.data.data() + i * 4) || hasNan(b.data.data() + i * 4);
    map.data[i] = broken ? 1.0f : float(errorAt(seenA, seenB, i));
  }
  return map;
}

}  // namespace kairos
