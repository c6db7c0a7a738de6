// The smallest volumes and the emptiest.
#include <gtest/gtest.h>

#include <cmath>

#include "numerics/field_oracle.h"

namespace kairos {
namespace {

RenderSettings settingsFor(const test::Scene& scene, const std::string& camera) {
  return test::settingsFor(scene, camera, test::softTransferFunction(scene.lattice.type), 11, 10);
}

TEST(OneVoxelThickAxes, CastTheField) {
  // Dense data have no extent along such an axis: parallel rays across it meet no sample, those along it do.
  // Sparse data fade to the background over one voxel at either side.
  for (const Vec3i& dims : {Vec3i{40, 1, 30}, {1, 37, 1}, {1, 1, 1}, {33, 20, 1}})
    for (bool dense : {false, true}) {
      test::Scene scene = test::constantScene(ElementType::f32, dims, 0.7);
      scene.lattice.dense = dense;
      double opacity = 0;
      for (const char* camera : {"x", "-y", "iso", "inside", "ortho", "orthoZ"}) {
        RenderSettings settings = settingsFor(scene, camera);
        settings.step = 0.25;
        opacity += test::expectCastsTheField(scene, settings, std::string(camera) + " through one voxel");
      }
      if (!dense) {
        EXPECT_GT(opacity, 1) << dims.x << " " << dims.y;
      }
    }
}

TEST(SingleVoxel, CastsItsTrilinearTent) {
  for (ElementType type : test::kAllTypes)
    for (const char* camera : {"iso", "ortho", "inside", "-y"})
      for (RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average}) {
        RenderSettings settings = settingsFor(test::singleVoxel(type), camera);
        settings.step = 0.25;
        settings.mode = mode;
        const double tolerance = mode == RenderMode::dvr ? 1 : test::fullScale(type);
        test::expectCastsTheField(test::singleVoxel(type), settings, camera,
                                  tolerance * test::kFullPrecision);
      }
}

TEST(EmptyVolume, ShowsNothingInAnyMode) {
  for (ElementType type : test::kAllTypes)
    for (RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average})
      for (bool skip : {false, true}) {
        const test::Scene scene = test::emptyScene(type);
        RenderSettings settings = settingsFor(scene, "iso");
        settings.mode = mode;
        settings.skipInvisible = skip;
        const test::Caster caster(scene, settings);
        const std::vector<int> counts = caster.sampleCounts();
        for (const auto& kernel : caster.kernels()) {
          const auto frame = caster.cast(kernel);
          for (size_t p = 0; p < counts.size(); ++p)
            for (int c = 0; c < frame.channels; ++c) {
              const float missed = mode == RenderMode::mip ? -HUGE_VALF : 0.0f;
              ASSERT_EQ(frame.pixel(p)[c], counts[p] > 0 ? 0.0f : missed) << kernel.name;
            }
        }
      }
}

TEST(ConstantVolume, IsTheSameMatterInEveryBrickAndApron) {
  for (ElementType type : test::kAllTypes)
    for (bool dense : {false, true}) {
      test::Scene scene = test::constantScene(type, {35, 18, 21}, 0.4);
      scene.lattice.dense = dense;
      for (const char* camera : {"iso", "inside", "ortho"}) {
        const double opacity = test::expectCastsTheField(scene, settingsFor(scene, camera), camera);
        EXPECT_GT(opacity, 1) << camera;
      }
    }
}

}  // namespace
}  // namespace kairos
