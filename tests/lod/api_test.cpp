// The snippet of docs/api.md that needs OpenGL, compiled and run.
#include "lod/gl_test.h"
#include "lod/lod_renderer.h"
#include "support/scenes.h"

namespace kairos {
namespace {

using LodApi = test::GlTest;

TEST_F(LodApi, RendersWithinABudget) {
  const test::Scene scene = test::plume(ElementType::f32);
  const Lattice& lattice = scene.lattice;
  const Field& field = scene.field;
  const Camera camera = test::cameraNamed("iso", lattice);
  ThreadPool pool(2);
  LodSettings lodSettings;
  lodSettings.width = lodSettings.height = 32;
  lodSettings.transferFunction = test::softTransferFunction(ElementType::f32);
  lodSettings.range = {0, 1};

  // clang-format off
GlContext context;  // throws GlError with what was tried
LodRenderer renderer(context, lattice, field, lodSettings, pool);
SteadyClock clock;
const LodProfile profile = renderer.profile(camera, clock);
auto controller = makePredictiveController({.secondsPerVoxel = profile.secondsPerVoxel,
                                            .secondsPerUnit = profile.secondsPerFragment});
const Importance importance = perSubvolume([](const SubvolumeView& v) { return v.maxOpacity * v.projectedArea; });
const Image& frame = renderer.render(camera, *controller, importance, 0.040, clock);
  // clang-format on

  EXPECT_EQ(frame.width, 32);
  EXPECT_GT(renderer.statistics().subvolumes, 0u);
}

}  // namespace
}  // namespace kairos
