#include "io/paraview_colour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/srgb.h"

namespace kairos {
namespace {

using Triple = std::array<double, 3>;
constexpr double kPi = std::numbers::pi;

Triple mix(const Triple& a, const Triple& b, double s) {
  return {(1 - s) * a[0] + s * b[0], (1 - s) * a[1] + s * b[1], (1 - s) * a[2] + s * b[2]};
}

Triple hsvFromRgb(const Triple& c) {
  const double hi = std::max({c[0], c[1], c[2]}), lo = std::min({c[0], c[1], c[2]}), d = hi - lo;
  if (d <= 0) return {0, 0, hi};
  double h = c[0] == hi ? (c[1] - c[2]) / d : c[1] == hi ? 2 + (c[2] - c[0]) / d : 4 + (c[0] - c[1]) / d;
  if (h < 0) h += 6;
  return {h / 6, d / hi, hi};
}

Triple rgbFromHsv(const Triple& c) {
  const auto component = [&](double n) {
    const double k = std::fmod(n + 6 * c[0], 6);
    return c[2] * (1 - c[1] * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  };
  return {component(5), component(3), component(1)};
}

constexpr Triple kWhite = {0.9505, 1.0, 1.089};  // D65, as VTK rounds it

// CIE L*a*b* of a display colour.
Triple labFromRgb(const Triple& c) {
  const double r = linearFromSrgb(c[0]), g = linearFromSrgb(c[1]), b = linearFromSrgb(c[2]);
  const Triple xyz = {0.4124 * r + 0.3576 * g + 0.1805 * b, 0.2126 * r + 0.7152 * g + 0.0722 * b,
                      0.0193 * r + 0.1192 * g + 0.9505 * b};
  Triple f;
  for (size_t i = 0; i < 3; ++i) {
    const double v = xyz[i] / kWhite[i];
    f[i] = v > 0.008856 ? std::cbrt(v) : 7.787 * v + 16.0 / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

Triple rgbFromLab(const Triple& lab) {
  const double fy = (lab[0] + 16) / 116;
  const Triple f = {lab[1] / 500 + fy, fy, fy - lab[2] / 200};
  Triple xyz;
  for (size_t i = 0; i < 3; ++i) {
    const double cube = f[i] * f[i] * f[i];
    xyz[i] = kWhite[i] * (cube > 0.008856 ? cube : (f[i] - 16.0 / 116) / 7.787);
  }
  const auto [x, y, z] = xyz;
  Triple rgb = {3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z,
                0.0557 * x - 0.2040 * y + 1.0570 * z};
  for (double& c : rgb) c = srgbFromLinear(c);
  // Colours outside the gamut are scaled into it.
  const double highest = std::max({rgb[0], rgb[1], rgb[2], 1.0});
  for (double& c : rgb) c = std::max(0.0, c / highest);
  return rgb;
}

// Moreland 2009, "Diverging Color Maps for Scientific Visualization": a polar form of Lab.
Triple mshFromLab(const Triple& lab) {
  const double m = std::sqrt(lab[0] * lab[0] + lab[1] * lab[1] + lab[2] * lab[2]);
  const double s = m > 0.001 ? std::acos(std::clamp(lab[0] / m, -1.0, 1.0)) : 0;
  return {m, s, s > 0.001 ? std::atan2(lab[2], lab[1]) : 0};
}

Triple labFromMsh(const Triple& c) {
  return {c[0] * std::cos(c[1]), c[0] * std::sin(c[1]) * std::cos(c[2]),
          c[0] * std::sin(c[1]) * std::sin(c[2])};
}

double angleBetween(double a, double b) {
  const double d = std::fmod(std::abs(a - b), 2 * kPi);
  return d > kPi ? 2 * kPi - d : d;
}

// A hue for the unsaturated end, turned away from the saturated one so that the change looks even.
double adjustedHue(const Triple& saturated, double unsaturatedM) {
  const auto [m, s, h] = saturated;
  if (m >= unsaturatedM - 0.1) return h;
  const double spin = s * std::sqrt(unsaturatedM * unsaturatedM - m * m) / (m * std::sin(s));
  return h > -0.3 * kPi ? h + spin : h - spin;
}

DisplayColour interpolateDiverging(const DisplayColour& a, const DisplayColour& b, double s) {
  constexpr double kSaturated = 0.05;
  Triple p = mshFromLab(labFromRgb(a)), q = mshFromLab(labFromRgb(b));
  if (p[1] > kSaturated && q[1] > kSaturated && angleBetween(p[2], q[2]) > 0.33 * kPi) {
    const Triple white = {std::max({p[0], q[0], 88.0}), 0, 0};  // in the middle of two distinct hues
    (s < 0.5 ? q : p) = white;
    s = s < 0.5 ? 2 * s : 2 * s - 1;
  }
  if (p[1] < kSaturated && q[1] > kSaturated)
    p[2] = adjustedHue(q, p[0]);
  else if (q[1] < kSaturated && p[1] > kSaturated)
    q[2] = adjustedHue(p, q[0]);
  return rgbFromLab(labFromMsh(mix(p, q, s)));
}

DisplayColour interpolateHsv(const DisplayColour& a, const DisplayColour& b, double s, bool wrap) {
  Triple p = hsvFromRgb(a), q = hsvFromRgb(b);
  if (wrap && std::abs(p[0] - q[0]) > 0.5) (p[0] > q[0] ? p : q)[0] -= 1;
  Triple hsv = mix(p, q, s);
  if (hsv[0] < 0) hsv[0] += 1;
  return rgbFromHsv(hsv);
}

}  // namespace

DisplayColour interpolateParaViewColour(ParaViewColourSpace space, const DisplayColour& a,
                                        const DisplayColour& b, double s) {
  switch (space) {
    case ParaViewColourSpace::hsv:
      return interpolateHsv(a, b, s, false);
    case ParaViewColourSpace::hsvWrapped:
      return interpolateHsv(a, b, s, true);
    case ParaViewColourSpace::lab:
      return rgbFromLab(mix(labFromRgb(a), labFromRgb(b), s));
    case ParaViewColourSpace::diverging:
      return interpolateDiverging(a, b, s);
    case ParaViewColourSpace::step:
      return b;
    default:
      return mix(a, b, s);
  }
}

double interpolateParaViewOpacity(double a, double b, double midpoint, double sharpness, double s) {
  midpoint = std::clamp(midpoint, 0.00001, 0.99999);
  s = s < midpoint ? 0.5 * s / midpoint : 0.5 + 0.5 * (s - midpoint) / (1 - midpoint);
  if (sharpness > 0.99) return s < 0.5 ? a : b;
  if (sharpness < 0.01) return (1 - s) * a + s * b;
  // A Hermite curve with the same slope at both ends, compressed towards the middle by the sharpness.
  const double power = 1 + 10 * sharpness;
  s = s < 0.5 ? 0.5 * std::pow(2 * s, power) : 1 - 0.5 * std::pow(2 * (1 - s), power);
  const double ss = s * s, sss = ss * s, slope = (1 - sharpness) * (b - a);
  const double value =
      (2 * sss - 3 * ss + 1) * a + (3 * ss - 2 * sss) * b + (sss - 2 * ss + s) * slope + (sss - ss) * slope;
  return std::clamp(value, std::min(a, b), std::max(a, b));
}

}  // namespace kairos
