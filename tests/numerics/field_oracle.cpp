#include "numerics/field_oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kairos::test {

double expectCastsTheField(const Scene& scene, RenderSettings settings, const std::string& what,
                           double tolerance) {
  settings.terminate = 1;
  const Caster caster(scene, settings);
  const std::vector<double> expected = castFieldDirectly(scene, settings), reference = caster.reference();
  const auto close = [](double a, double b, double limit) { return a == b || std::abs(a - b) <= limit; };
  EXPECT_EQ(expected.size(), reference.size()) << what;
  for (size_t i = 0; i < expected.size(); ++i)
    if (!close(reference[i], expected[i], 1e-9 * (1 + std::abs(expected[i])))) {
      ADD_FAILURE() << what << ", reference, value " << i << ": " << reference[i] << " against "
                    << expected[i];
      break;
    }
  const std::vector<int> counts = caster.sampleCounts();
  const auto channels = size_t(settings.channels());
  for (const auto& kernel : caster.kernels()) {
    const CastFrame frame = caster.cast(kernel);
    double worst = 0;
    for (size_t i = 0; i < expected.size(); ++i) {
      const double samples = settings.mode == RenderMode::average ? std::max(1, counts[i / channels]) : 1;
      if (!close(double(frame.pixels[i]), expected[i], tolerance * samples))
        worst = std::max(worst, std::abs(double(frame.pixels[i]) - expected[i]) / samples);
    }
    EXPECT_EQ(worst, 0) << what << ", " << kernel.name << ": beyond " << tolerance;
  }
  double opacity = 0;
  for (size_t i = channels - 1; i < expected.size(); i += channels) opacity += expected[i];
  return opacity;
}

double largestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]);
    largest = std::isnan(difference) ? HUGE_VAL : std::max(largest, difference);
  }
  return largest;
}

double rootMeanSquareDifference(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / double(a.size()));
}

std::vector<double> asDoubles(const CastFrame& frame) {
  return {frame.pixels.begin(), frame.pixels.end()};
}

TransferFunction homogeneous(double alpha, const Vec3d& colour) {
  return {{{0, colour}}, {{0, alpha}, {1, alpha}}};
}

RenderSettings fromAbove(const Scene& scene, const TransferFunction& tf, const Vec3d& eye, double height,
                         int pixels) {
  RenderSettings settings = settingsFor(scene, "orthoZ", tf, pixels, pixels);
  settings.camera.eye = eye;
  settings.camera.target = eye - Vec3d{0, 0, 1};
  settings.camera.imageHeight = height;
  settings.terminate = 1;
  return settings;
}

}  // namespace kairos::test
