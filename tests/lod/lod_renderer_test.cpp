// Images of the LOD renderer against the double-precision ray caster and against an oracle of its own, and
// what it loads to make them.
#include "lod/lod_renderer.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/compositing.h"
#include "core/error.h"
#include "lod/differences.h"
#include "lod/gl_test.h"
#include "raycast/reference_caster.h"
#include "support/images.h"
#include "support/scenes.h"

namespace kairos {
namespace {

// The same picture, in subvolumes small enough for a few dozen of them.
LodSettings lodSettings(const RenderSettings& s) {
  LodSettings settings;
  settings.width = s.width;
  settings.height = s.height;
  settings.transferFunction = s.transferFunction;
  settings.range = s.range;
  settings.unitDistance = s.unitDistance;
  settings.step = s.step;
  settings.mode = s.mode == RenderMode::mip ? LodMode::mip : LodMode::dvr;
  settings.shape = SliceShape::shells;
  settings.subdivision.minimumEdge = 16;
  settings.subdivision.memoryLimit = 150000;
  settings.subdivision.deviationThreshold = 0.05 * double(s.range.hi);  // some are split, others are not
  return settings;
}

// In subvolumes of 16 cells, whatever the values.
LodSettings evenSettings(const RenderSettings& s) {
  LodSettings settings = lodSettings(s);
  settings.subdivision.memoryLimit = 20000;
  settings.subdivision.deviationThreshold = 1e300;
  return settings;
}

class LodRendererTest : public test::GlTest {
 protected:
  Image renderAt(const test::Scene& scene, const LodSettings& settings, const Camera& camera,
                 const std::function<std::unique_ptr<LodController>()>& make = makeFinestController) {
    LodRenderer renderer(*context(), scene.lattice, scene.field, settings, pool_);
    const auto controller = make();
    renderer.render(camera, *controller, uniformImportance(), 0, clock_);
    statistics_ = renderer.statistics();
    return renderer.image();
  }

  static RenderSettings casterSettings(const test::Scene& scene, const char* camera, int width = 48,
                                       int height = 40) {
    RenderSettings settings =
        test::settingsFor(scene, camera, test::softTransferFunction(scene.lattice.type), width, height);
    settings.terminate = 1;
    return settings;
  }

  // The largest difference of any channel, and how many pixels differ by more than 1e-4.
  struct Difference {
    double largest = 0;
    int beyond = 0;
  };
  Difference againstCaster(const test::Scene& scene, const RenderSettings& settings) {
    const BrickVolume bricks(scene.lattice, scene.field, pool_);
    const std::vector<double> expected = castReference(settings, bricks);
    const ClassificationTable table = settings.classification(scene.lattice);
    const Image found = renderAt(scene, lodSettings(settings), settings.camera);
    const auto channels = size_t(settings.channels());
    Difference difference;
    for (size_t p = 0; p < expected.size() / channels; ++p) {
      std::array<double, 4> colour{};
      if (channels == 4)
        std::copy_n(expected.begin() + int64_t(4 * p), 4, colour.begin());
      else if (std::isfinite(expected[p]))
        colour = table.classify<double>(expected[p]);
      double worst = 0;
      for (size_t c = 0; c < 4; ++c)
        worst = std::max(worst, std::abs(colour[c] - double(found.data[4 * p + c])));
      difference.largest = std::max(difference.largest, worst);
      difference.beyond += worst > 1e-4;
    }
    return difference;
  }

  ThreadPool pool_{2};
  SteadyClock clock_;
  LodStatistics statistics_;
};

double largestDifference(const Image& a, const Image& b) {
  double largest = 0;
  for (size_t i = 0; i < a.data.size(); ++i)
    largest = std::max(largest, std::abs(double(a.data[i]) - double(b.data[i])));
  return largest;
}

TEST_F(LodRendererTest, AgreesWithTheRayCasterAtFullResolution) {
  for (const ElementType type : test::kAllTypes)
    for (const char* camera : {"iso", "-y", "ortho", "close", "inside"}) {
      const test::Scene scene = test::plume(type);
      const RenderSettings settings = casterSettings(scene, camera);
      const Difference d = againstCaster(scene, settings);
      EXPECT_EQ(d.beyond, 0) << name(type) << " " << camera << ", largest difference " << d.largest;
      EXPECT_GE(statistics_.subvolumes, 4u) << camera;
    }
}

// Where the data end without fading, a sample within float rounding of a face may be taken by one and not by
// the other.
TEST_F(LodRendererTest, AgreesWithTheRayCasterOnDenseData) {
  for (const char* camera : {"iso", "ortho", "inside"}) {
    const test::Scene scene = test::marschnerLobb(ElementType::f32);
    const RenderSettings settings = casterSettings(scene, camera);
    const Difference d = againstCaster(scene, settings);
    EXPECT_LE(d.beyond, settings.width * settings.height / 500) << camera << " " << d.largest;
  }
}

TEST_F(LodRendererTest, AgreesWithTheRayCasterInMaximumProjections) {
  for (const char* camera : {"iso", "ortho"})
    for (const ElementType type : test::kAllTypes) {
      const test::Scene scene = test::plume(type);
      RenderSettings settings = casterSettings(scene, camera);
      settings.mode = RenderMode::mip;
      const Difference d = againstCaster(scene, settings);
      EXPECT_EQ(d.beyond, 0) << camera << " " << name(type) << ", largest difference " << d.largest;
    }
}

TEST_F(LodRendererTest, AgreesOnRotatedAnisotropicLattices) {
  test::Scene scene = test::plume(ElementType::f32);
  const double c = std::cos(0.4), s = std::sin(0.4);
  scene.lattice.worldFromIndex.column = {Vec3d{c * 0.5, s * 0.5, 0}, Vec3d{-s * 0.8, c * 0.8, 0},
                                         Vec3d{0, 0, 1.1}};
  scene.lattice.worldFromIndex.translation = {100, -3, 7};
  for (const char* camera : {"iso", "ortho"}) {
    const Difference d = againstCaster(scene, casterSettings(scene, camera));
    EXPECT_EQ(d.beyond, 0) << camera << ", largest difference " << d.largest;
  }
}

TEST_F(LodRendererTest, SingleVoxelAxesAreRendered) {
  const test::Scene scene = test::constantScene(ElementType::u8, {20, 1, 12}, 0.6);
  const RenderSettings settings = casterSettings(scene, "iso");
  const Difference d = againstCaster(scene, settings);
  EXPECT_LE(d.beyond, settings.width * settings.height / 500) << d.largest;
  EXPECT_GT(statistics_.fragments, 0);
}

// Planes across the view, each sample's opacity corrected for its ray: the same integral from other samples.
std::array<double, 4> planarRay(const test::Scene& scene, const RenderSettings& settings,
                                const ClassificationTable& table, int x, int y) {
  const RayGenerator rays(settings.camera, settings.width, settings.height);
  const Ray ray = rays.ray(x + 0.5, y + 0.5);
  const double cosine = dot(ray.direction, rays.forward()), step = settings.worldStep(scene.lattice);
  const Affine fromWorld = scene.lattice.worldFromIndex.inverse();
  const PointBox box = scene.lattice.samplingBox();
  std::array<double, 4> front{};
  for (int k = 0; k < 2000; ++k) {
    const Vec3d p = fromWorld.point(ray.origin + ray.direction * ((k + 0.5) * step / cosine));
    if (componentMin(p, box.lo) != box.lo || componentMax(p, box.hi) != box.hi) continue;
    const Vec3i low{int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))};
    double value = 0;
    for (int c = 0; c < 8; ++c) {
      const Vec3i v = low + Vec3i{c & 1, c >> 1 & 1, c >> 2};
      const double weight = (1 - std::abs(p.x - v.x)) * (1 - std::abs(p.y - v.y)) * (1 - std::abs(p.z - v.z));
      if (weight > 0) value += weight * scene.field.value(scene.lattice.sourceOf(v));
    }
    std::array<double, 4> colour = table.classify<double>(value);
    if (colour[3] <= 0) continue;
    const double alpha = correctedOpacity(colour[3], 1 / cosine);
    for (size_t c = 0; c < 3; ++c) colour[c] *= alpha / colour[3];
    colour[3] = alpha;
    over<4>(front.data(), colour.data());
  }
  return front;
}

TEST_F(LodRendererTest, PlanarSlicesAreCorrectedAlongEachRay) {
  const test::Scene scene = test::plume(ElementType::f32);
  for (const char* camera : {"iso", "inside"}) {
    const RenderSettings settings = casterSettings(scene, camera, 32, 28);
    LodSettings planes = lodSettings(settings);
    planes.shape = SliceShape::planes;
    const Image found = renderAt(scene, planes, settings.camera);
    const ClassificationTable table = settings.classification(scene.lattice);
    double largest = 0;
    for (int y = 0; y < settings.height; ++y)
      for (int x = 0; x < settings.width; ++x) {
        const auto expected = planarRay(scene, settings, table, x, y);
        for (int c = 0; c < 4; ++c)
          largest = std::max(largest, std::abs(expected[size_t(c)] - double(found.pixel(x, y)[c])));
      }
    EXPECT_LE(largest, 1e-4) << camera;
  }
}

TEST_F(LodRendererTest, BlendingOrderDoesNotMatter) {
  const test::Scene scene = test::denseNoise(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodSettings order = lodSettings(settings);
  const Image front = renderAt(scene, order, settings.camera);
  order.order = BlendOrder::backToFront;
  EXPECT_LE(largestDifference(front, renderAt(scene, order, settings.camera)), 1e-5);
}

TEST_F(LodRendererTest, SubdivisionDoesNotChangeTheImage) {
  const test::Scene scene = test::denseNoise(ElementType::u16);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodSettings whole = lodSettings(settings), parts = whole;
  whole.subdivision.memoryLimit = ~uint64_t(0);
  whole.subdivision.deviationThreshold = 1e9;
  parts.subdivision.minimumEdge = 8;
  parts.subdivision.memoryLimit = 2000;
  const Image one = renderAt(scene, whole, settings.camera);
  EXPECT_EQ(statistics_.subvolumes, 1u);
  const Image many = renderAt(scene, parts, settings.camera);
  EXPECT_GT(statistics_.subvolumes, 50u);
  EXPECT_LE(largestDifference(one, many), 2e-5);
}

TEST_F(LodRendererTest, CoarserLevelsTakeFewerSlicesAndKeepTheOpacity) {
  const test::Scene scene = test::constantScene(ElementType::f32, {48, 48, 48}, 0.5);
  const RenderSettings settings = casterSettings(scene, "ortho");
  const Image fine = renderAt(scene, evenSettings(settings), settings.camera);
  const uint64_t slices = statistics_.slices;
  const Image coarse =
      renderAt(scene, evenSettings(settings), settings.camera, [] { return makeToleranceController(1e9); });
  EXPECT_LT(statistics_.slices * 3, slices);
  // One table per slice distance: what is seen through the middle is as opaque as before, but for where the
  // first and the last slice fall.
  const float a = fine.pixel(24, 20)[3], b = coarse.pixel(24, 20)[3];
  EXPECT_GT(a, 0.2f);
  EXPECT_NEAR(a, b, 0.1f * a);
}

TEST_F(LodRendererTest, ResidentTexturesAreNotLoadedAgain_L5) {
  const test::Scene scene = test::plume(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodRenderer renderer(*context(), scene.lattice, scene.field, evenSettings(settings), pool_);
  const auto finest = makeFinestController();
  renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
  const Image first = renderer.image();
  EXPECT_GT(renderer.statistics().bytesLoaded, 0u);
  renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
  EXPECT_EQ(renderer.statistics().bytesLoaded, 0u);
  EXPECT_EQ(renderer.statistics().texturesKept, renderer.statistics().subvolumes);
  EXPECT_TRUE(test::imagesEqualBitForBit(first, renderer.image()));
}

TEST_F(LodRendererTest, AWarmCacheIsPredictedToLoadNothing_L7) {
  const test::Scene scene = test::plume(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodRenderer renderer(*context(), scene.lattice, scene.field, evenSettings(settings), pool_);
  const auto finest = makeFinestController();
  for (int frame = 0; frame < 2; ++frame) {
    renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
    for (const SubvolumeRecord& record : renderer.statistics().records) {
      EXPECT_EQ(record.timing.work.resident, frame == 1);
      EXPECT_EQ(loadSeconds(1e-9, record.timing.work) == 0, frame == 1);
    }
  }
}

TEST_F(LodRendererTest, ProfilingFillsTheTextureMemoryAndMeasuresLoading_L7) {
  const test::Scene scene = test::denseNoise(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodRenderer renderer(*context(), scene.lattice, scene.field, evenSettings(settings), pool_);
  const LodProfile profile = renderer.profile(settings.camera, clock_);
  EXPECT_GT(profile.secondsPerVoxel, 0);
  EXPECT_GT(profile.secondsPerFragment, 0);
  EXPECT_GT(profile.secondsPerSlice, 0);
  const auto finest = makeFinestController();
  renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
  EXPECT_EQ(renderer.statistics().bytesLoaded, 0u) << "profiling had left every texture resident";
}

TEST_F(LodRendererTest, LittleTextureMemoryCostsLoadingButChangesNothing_L5) {
  const test::Scene scene = test::plume(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodSettings scarce = evenSettings(settings);
  const Image expected = renderAt(scene, scarce, settings.camera);
  scarce.textureMemory = 45000;  // two of the subvolumes' textures
  LodRenderer renderer(*context(), scene.lattice, scene.field, scarce, pool_);
  const auto finest = makeFinestController();
  for (int frame = 0; frame < 2; ++frame) {
    renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
    EXPECT_LE(renderer.textureBytes(), scarce.textureMemory);
    EXPECT_GT(renderer.statistics().texturesLoaded, 0u);
    EXPECT_TRUE(test::imagesEqualBitForBit(expected, renderer.image()));
  }
  EXPECT_GT(renderer.textureCounters().reused, 0u);
}

TEST_F(LodRendererTest, APlayingVolumeEqualsAFreshUploadAndLoadsWhatChanged) {
  for (const ElementType type : {ElementType::u8, ElementType::f32}) {
    const test::Scene start = test::movingBall(type, 48, 0);
    const RenderSettings settings = casterSettings(start, "iso");
    LodRenderer renderer(*context(), start.lattice, start.field, evenSettings(settings), pool_);
    const auto finest = makeFinestController();
    renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
    const uint64_t whole = renderer.statistics().bytesLoaded;
    test::Scene before = start;
    for (int step = 1; step <= 4; ++step) {
      const test::Scene after = test::movingBall(type, 48, step);
      const ChangedVoxels changes = test::differences(before, after);
      renderer.apply(changes);
      renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
      EXPECT_TRUE(test::imagesEqualBitForBit(renderAt(after, evenSettings(settings), settings.camera),
                                             renderer.image()))
          << "step " << step;
      // Proportional to the blocks of 8^3 that changed: at most their box in each of up to 8 subvolumes.
      const uint64_t texel = type == ElementType::f32 ? 4 : 2;
      EXPECT_GT(renderer.statistics().bytesLoaded, 0u);
      EXPECT_LE(renderer.statistics().bytesLoaded, 8 * 24u * 24 * 24 * texel);
      EXPECT_LT(renderer.statistics().bytesLoaded, whole / 4);
      EXPECT_LT(renderer.statistics().texturesLoaded, renderer.statistics().subvolumes);
      before = after;
    }
    renderer.apply(test::differences(before, before));
    renderer.render(settings.camera, *finest, uniformImportance(), 0, clock_);
    EXPECT_EQ(renderer.statistics().bytesLoaded, 0u) << "nothing changed";
  }
}

TEST_F(LodRendererTest, APlayingVolumeEqualsAFreshUploadAtMixedLevels) {
  const test::Scene start = test::movingBall(ElementType::f32, 48, 0);
  const RenderSettings settings = casterSettings(start, "iso");
  const auto mixed = [] { return makeToleranceController(0.01); };
  LodRenderer renderer(*context(), start.lattice, start.field, evenSettings(settings), pool_);
  const auto controller = mixed();
  test::Scene before = start;
  for (int step = 0; step <= 3; ++step) {
    const test::Scene after = test::movingBall(ElementType::f32, 48, step);
    if (step > 0) renderer.apply(test::differences(before, after));
    // Twice: the second time, every neighbour's level is known.
    for (int i = 0; i < 2; ++i) renderer.render(settings.camera, *controller, uniformImportance(), 0, clock_);
    EXPECT_EQ(renderer.statistics().openBoundaries, 0u);
    LodRenderer fresh(*context(), after.lattice, after.field, evenSettings(settings), pool_);
    const auto other = mixed();
    for (int i = 0; i < 2; ++i) fresh.render(settings.camera, *other, uniformImportance(), 0, clock_);
    EXPECT_TRUE(test::imagesEqualBitForBit(fresh.image(), renderer.image())) << "step " << step;
    before = after;
  }
  std::vector<int> levels;
  for (const SubvolumeRecord& record : renderer.statistics().records) levels.push_back(record.level);
  EXPECT_NE(*std::min_element(levels.begin(), levels.end()), *std::max_element(levels.begin(), levels.end()));
}

TEST_F(LodRendererTest, WhatCannotBeSeenIsNotRendered) {
  const test::Scene scene = test::sparseBalls(ElementType::u8);
  const RenderSettings settings = casterSettings(scene, "iso");
  renderAt(scene, evenSettings(settings), settings.camera);
  EXPECT_GT(statistics_.skipped, statistics_.subvolumes);
  Camera away = settings.camera;
  away.target = away.eye + (away.eye - away.target);
  const Image nothing = renderAt(scene, evenSettings(settings), away);
  EXPECT_EQ(statistics_.subvolumes, 0u);
  for (float v : nothing.data) ASSERT_EQ(v, 0.0f);
}

// Coarse levels of detail, another one in each subvolume.
class MixedController : public LodController {
 public:
  void beginFrame(const LodFramePlan&) override {}
  int choose(const LodTask& task, double) override {
    return std::min(1 + int(task.subvolume % 3), int(task.work.size()) - 1);
  }
  void rendered(const LodTask&, int, const LodTiming&) override {}
  void endFrame(double) override {}
};

// However far apart the slices on both sides of a face are, all of a ray's way counts, and counts once.
TEST_F(LodRendererTest, MixedLevelsOfAHomogeneousVolumeHaveTheOpacityOfOne_L4) {
  const test::Scene scene = test::constantScene(ElementType::f32, {64, 48, 80}, 0.5);
  RenderSettings settings = casterSettings(scene, "iso");
  settings.camera = fittedCamera("z", scene.lattice.worldBounds(), 30, 1);
  settings.camera.projection = Camera::Projection::orthographic;
  settings.camera.imageHeight = 30;
  LodSettings even = evenSettings(settings);
  even.transferFunction = TransferFunction({{0, {1, 1, 1}}, {1, {1, 1, 1}}}, {{0, 0.02}, {1, 0.02}});
  even.range = {0, 1};
  const Image image =
      renderAt(scene, even, settings.camera, [] { return std::make_unique<MixedController>(); });
  const PointBox box = scene.lattice.samplingBox();
  const double expected = 1 - std::pow(1 - 0.02, box.hi.z - box.lo.z);
  for (size_t p = 0; p < image.data.size(); p += 4) ASSERT_NEAR(image.data[p + 3], expected, 2e-5) << p / 4;
}

TEST_F(LodRendererTest, RefusesWhatDoesNotFit) {
  const test::Scene scene = test::plume(ElementType::f32);
  LodSettings settings = evenSettings(casterSettings(scene, "iso"));
  settings.textureMemory = 100;
  EXPECT_THROW(LodRenderer(*context(), scene.lattice, scene.field, settings, pool_), OptionError);
  settings = evenSettings(casterSettings(scene, "iso"));
  settings.width = 32768;
  EXPECT_THROW(LodRenderer(*context(), scene.lattice, scene.field, settings, pool_), OptionError);
  settings = evenSettings(casterSettings(scene, "iso"));
  settings.lodsPerLevel = 3;
  EXPECT_THROW(LodRenderer(*context(), scene.lattice, scene.field, settings, pool_), OptionError);
}

// Time stands still: every share is the whole budget's, so that the finest levels are chosen; then a frame
// has no time at all.
class SetClock : public Clock {
 public:
  double now = 0, tick = 0;
  double seconds() override { return now += tick; }
};

TEST_F(LodRendererTest, TimeIsTakenFromTheGivenClock) {
  const test::Scene scene = test::plume(ElementType::f32);
  const RenderSettings settings = casterSettings(scene, "iso");
  LodRenderer renderer(*context(), scene.lattice, scene.field, evenSettings(settings), pool_);
  SetClock clock;
  const auto controller = makePredictiveController({.secondsPerUnit = 1e-9});
  renderer.render(settings.camera, *controller, uniformImportance(), 1, clock);
  for (const SubvolumeRecord& record : renderer.statistics().records) EXPECT_EQ(record.lod, 0);
  EXPECT_FALSE(renderer.statistics().infeasible);
  EXPECT_EQ(renderer.statistics().totalSeconds, 0);
  clock.tick = 1;
  const auto late = makePredictiveController({.secondsPerUnit = 1});
  renderer.render(settings.camera, *late, uniformImportance(), 1, clock);
  for (const SubvolumeRecord& record : renderer.statistics().records)
    EXPECT_EQ(record.lod, renderer.settings().lodCount(
                              renderer.volume().subdivision().subvolumes()[record.subvolume].levels) -
                              1);
  EXPECT_TRUE(renderer.statistics().infeasible);
}

}  // namespace
}  // namespace kairos
