// Uses the installed package from memory alone: a homogeneous block, half of which clears up.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "diff/differential_renderer.h"

namespace {

constexpr int kEdge = 33;
constexpr double kOpacity = 0.05;  // over one voxel

bool near(const char* what, double found, double expected) {
  const bool ok = std::abs(found - expected) < 1e-4;
  std::printf("%s: alpha %.6f, expected %.6f%s\n", what, found, expected, ok ? "" : "  WRONG");
  return ok;
}

double alpha(const kairos::Image& image, int x) {
  return image.pixel(x, image.height / 2)[3];
}

}  // namespace

int main() {
  kairos::Lattice lattice;
  lattice.domain = {{0, 0, 0}, {kEdge, kEdge, kEdge}};
  lattice.dense = true;

  kairos::RenderSettings settings;
  settings.camera.eye = {16, -40, 16};
  settings.camera.target = {16, 16, 16};
  settings.camera.up = {0, 0, 1};
  settings.camera.projection = kairos::Camera::Projection::orthographic;
  settings.camera.imageHeight = 36;
  settings.width = settings.height = 64;
  settings.range = {0, 255};
  settings.transferFunction = {{{0, {1, 1, 1}}, {255, {1, 1, 1}}},
                               {{0, 0}, {1, 0}, {2, kOpacity}, {255, kOpacity}}};
  settings.step = 0.5;
  settings.terminate = 1;

  kairos::RendererOptions options;
  options.threads = 1;
  kairos::DifferentialRenderer renderer(lattice, settings, options);

  // Looking along y, x runs from the left to the right of the image; 32 voxels of path.
  std::vector<uint8_t> values(size_t(kEdge) * kEdge * kEdge, 200);
  const double opaque = 1 - std::pow(1 - kOpacity, kEdge - 1);
  const kairos::Image& image = renderer.render(values.data());
  bool ok = near("first step, left", alpha(image, 20), opaque) &
            near("first step, right", alpha(image, 44), opaque);

  for (size_t i = 0; i < values.size(); ++i)
    if (i % kEdge > kEdge / 2) values[i] = 0;
  renderer.render(values.data());
  ok &= near("second step, left", alpha(image, 20), opaque) & near("second step, right", alpha(image, 44), 0);
  ok &= renderer.statistics().segmentsRecast > 0;
  ok &= renderer.statistics().segmentsRecast < renderer.statistics().segmentsTotal;
  return ok ? 0 : 1;
}
