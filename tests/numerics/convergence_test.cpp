// Errors fall as they should: with the square of the sample distance, of the voxels' edge and of the pixels'.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/compositing.h"
#include "numerics/field_oracle.h"

namespace kairos {
namespace {

// A smooth blob in the unit cube, zero with its first two derivatives where it ends: rays enter and leave
// matter gently, so that no order is lost at a face. Two more, off its centre, leave no symmetry to cancel
// errors.
double blob(const Vec3d& p) {
  const auto bump = [&](const Vec3d& centre, double radius) {
    const Vec3d q = (p - centre) * (1 / radius);
    const double inside = 1 - dot(q, q);
    return inside > 0 ? inside * inside * inside : 0.0;
  };
  return 0.6 * bump({0.5, 0.5, 0.5}, 0.45) + 0.4 * bump({0.4, 0.55, 0.45}, 0.3) +
         0.3 * bump({0.6, 0.4, 0.6}, 0.25);
}

TransferFunction smoothTransferFunction() {
  return {{{0, {0.1, 0.2, 0.9}}, {1.3, {1, 0.8, 0.1}}}, {{0, 0}, {1.3, 0.4}}};
}

// The blob at `edge` + 1 points an axis; opacities are meant over a sixteenth of the cube.
test::Scene sampledBlob(int edge) {
  test::Scene scene{"blob", test::denseLattice(ElementType::f32, {edge + 1, edge + 1, edge + 1}), {}};
  scene.lattice.worldFromIndex = Affine::scale({1.0 / edge, 1.0 / edge, 1.0 / edge});
  scene.field =
      test::sampledField(scene.lattice, [&](const Vec3i& v) { return blob(Vec3d(v) * (1.0 / edge)); });
  return scene;
}

RenderSettings settingsFor(const test::Scene& scene, const char* camera, int pixels) {
  RenderSettings settings = test::settingsFor(scene, camera, smoothTransferFunction(), pixels, pixels);
  settings.range = {0, 1.3f};
  settings.unitDistance = 1.0 / 16;
  settings.terminate = 1;
  return settings;
}

// Errors of three halvings: the order is the mean binary logarithm of their ratios.
void expectSecondOrder(const std::array<double, 3>& errors, const std::string& what) {
  EXPECT_GT(errors[2], 1e-7) << what << ": nothing left to converge";
  EXPECT_GE(0.5 * std::log2(errors[0] / errors[2]), 1.9)
      << what << ": " << errors[0] << " " << errors[1] << " " << errors[2];
}

TEST(Convergence, IsOfSecondOrderInTheSampleDistance) {
  const test::Scene scene = sampledBlob(24);
  // Halved twice from where the error falls regularly; the last stays above the table's own, some 1e-6.
  for (const auto& [camera, coarsest] : {std::pair("iso", 2.0), {"ortho", 2.0}, {"inside", 1.0}}) {
    RenderSettings settings = settingsFor(scene, camera, 16);
    const auto imageAt = [&](double step) {
      settings.step = step;
      return test::Caster(scene, settings).reference();
    };
    const auto finest = imageAt(1.0 / 64);
    std::array<double, 3> errors;
    for (size_t i = 0; i < 3; ++i)
      errors[i] = test::rootMeanSquareDifference(imageAt(coarsest * std::exp2(-double(i))), finest);
    expectSecondOrder(errors, camera);
  }
}

TEST(Convergence, IsOfFirstOrderWhereAFaceCutsMatter) {
  // The lattice of samples is global, so a ray enters dense data anywhere within a sample's share of it, and
  // that share counts whole or not at all. Halving the distance halves what that costs.
  test::Scene scene{"cut", test::denseLattice(ElementType::f32, {24, 24, 24}), {}};
  scene.field = test::sampledField(
      scene.lattice, [](const Vec3i& v) { return 0.2 + 0.6 * test::smoothNoise(Vec3d(v), 9, 4); });
  RenderSettings settings =
      test::settingsFor(scene, "iso", test::softTransferFunction(ElementType::f32), 24, 24);
  settings.terminate = 1;
  const auto imageAt = [&](double step) {
    settings.step = step;
    return test::Caster(scene, settings).reference();
  };
  const auto finest = imageAt(1.0 / 64);
  const double coarse = test::rootMeanSquareDifference(imageAt(1), finest),
               fine = test::rootMeanSquareDifference(imageAt(0.25), finest);
  EXPECT_GE(0.5 * std::log2(coarse / fine), 0.9) << coarse << " " << fine;
}

// The image of the blob itself on the same samples as the given settings take.
std::vector<double> castBlob(const test::Scene& scene, const RenderSettings& settings) {
  const ClassificationTable table = settings.classification(scene.lattice);
  const RayGenerator generator(settings.camera, settings.width, settings.height);
  const double step = settings.worldStep(scene.lattice);
  std::vector<double> image;
  for (int y = 0; y < settings.height; ++y)
    for (int x = 0; x < settings.width; ++x) {
      const Ray ray = generator.ray(x + 0.5, y + 0.5);
      double colour[4] = {0, 0, 0, 0};
      for (int k = 0; k < int(8 / step); ++k) {
        const auto sample = table.classify(blob(ray.origin + ray.direction * ((k + 0.5) * step)));
        over<4>(colour, sample.data());
      }
      image.insert(image.end(), colour, colour + 4);
    }
  return image;
}

TEST(Convergence, IsOfSecondOrderInTheGrid) {
  for (const char* camera : {"iso", "ortho"}) {
    std::array<double, 3> errors, kernelErrors;
    for (size_t i = 0; i < 3; ++i) {
      const int edge = 12 << i;
      const test::Scene scene = sampledBlob(edge);
      RenderSettings settings = settingsFor(scene, camera, 14);
      settings.step = edge / 192.0;
      const test::Caster caster(scene, settings);
      const auto exact = castBlob(scene, settings);
      errors[i] = test::rootMeanSquareDifference(caster.reference(), exact);
      kernelErrors[i] = test::rootMeanSquareDifference(test::asDoubles(caster.cast()), exact);
    }
    expectSecondOrder(errors, camera);
    expectSecondOrder(kernelErrors, std::string(camera) + ", fastest kernel");
  }
}

TEST(Convergence, IsOfSecondOrderInThePixels) {
  // A pixel's ray through its centre against the mean over the pixel, taken from 8x8 rays of its own (whose
  // mean is itself 64 times closer).
  const test::Scene scene = sampledBlob(24);
  const auto imageAt = [&](int pixels) {
    return test::Caster(scene, settingsFor(scene, "iso", pixels)).reference();
  };
  std::array<double, 3> errors;
  for (size_t i = 0; i < 3; ++i) {
    const int pixels = 10 << i;
    const auto centres = imageAt(pixels), fine = imageAt(8 * pixels);
    std::vector<double> means(centres.size(), 0);
    for (int y = 0; y < 8 * pixels; ++y)
      for (int x = 0; x < 8 * pixels; ++x)
        for (int c = 0; c < 4; ++c)
          means[size_t((y / 8 * pixels + x / 8) * 4 + c)] += fine[size_t((y * 8 * pixels + x) * 4 + c)] / 64;
    errors[i] = test::rootMeanSquareDifference(centres, means);
  }
  expectSecondOrder(errors, "pixels");
}

}  // namespace
}  // namespace kairos
