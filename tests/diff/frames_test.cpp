// The first invariant: the differential frames are the full render's, bit for bit.
#include <gtest/gtest.h>

#include <functional>

#include "core/error.h"
#include "sequences.h"

namespace kairos::test {
namespace {

struct Variant {
  const char* name;
  std::function<void(RenderSettings&, ElementType)> set;
  RendererOptions options;
};

std::vector<Variant> variants() {
  const auto soft = [](RenderSettings&, ElementType) {};
  RendererOptions two = withMethod(Method::segments, 2), reversed = two;
  reversed.tileOrder = RendererOptions::TileOrder::reversed;
  reversed.tilesPerTask = 1;
  const RendererOptions one = withMethod(Method::segments, 1);
  return {
      {"soft", soft, one},
      {"fast", [](RenderSettings& s, ElementType) { s.precision = Precision::fast; }, two},
      {"softHalfStepTwoThreads", [](RenderSettings& s, ElementType) { s.step = 0.5; }, two},
      {"softWithoutSkipping", [](RenderSettings& s, ElementType) { s.skipInvisible = false; }, one},
      {"softNeverTerminating", [](RenderSettings& s, ElementType) { s.terminate = 1; }, reversed},
      {"shaded", [](RenderSettings& s, ElementType) { s.shade = true; }, two},
      {"shadedWithDepth",
       [](RenderSettings& s, ElementType) {
         s.shade = s.depth = true;
         s.step = 0.7;
       },
       one},
      {"depth", [](RenderSettings& s, ElementType) { s.depth = true; }, two},
      {"opaque", [](RenderSettings& s, ElementType t) { s.transferFunction = opaqueTransferFunction(t); },
       one},
      {"opaqueShadedHalfStep",
       [](RenderSettings& s, ElementType t) {
         s.transferFunction = opaqueTransferFunction(t);
         s.shade = true;
         s.step = 0.5;
         s.terminate = 0.9f;
       },
       two},
      {"windowed", [](RenderSettings& s, ElementType t) { s.transferFunction = windowedTransferFunction(t); },
       one},
      {"windowedNearest",
       [](RenderSettings& s, ElementType t) {
         s.transferFunction = windowedTransferFunction(t);
         s.filter = Filter::nearest;
       },
       two},
      {"nearestShaded",
       [](RenderSettings& s, ElementType) {
         s.filter = Filter::nearest;
         s.shade = true;
       },
       one},
      {"preintegrated", [](RenderSettings& s, ElementType) { s.preintegrated = true; }, two},
      {"preintegratedWindowed",
       [](RenderSettings& s, ElementType t) {
         s.preintegrated = true;
         s.step = 2.5;
         s.transferFunction = windowedTransferFunction(t);
       },
       one},
      {"byError", [](RenderSettings& s, ElementType) { s.error = 1e-3; }, two},
      {"byErrorOpaque",
       [](RenderSettings& s, ElementType t) {
         s.error = 1e-2;
         s.transferFunction = opaqueTransferFunction(t);
       },
       one},
      {"mip", [](RenderSettings& s, ElementType) { s.mode = RenderMode::mip; }, two},
      {"average", [](RenderSettings& s, ElementType) { s.mode = RenderMode::average; }, one},
  };
}

using Parameters = std::tuple<size_t, std::string>;

const Sequence& sequenceNumber(size_t i) {
  static const std::vector<Sequence> sequences = allSequences();
  return sequences[i];
}

class DifferentialFrames : public testing::TestWithParam<Parameters> {};

TEST_P(DifferentialFrames, EqualTheFullRenderBitForBit) {
  const auto& [number, camera] = GetParam();
  const Sequence& sequence = sequenceNumber(number);
  const ElementType type = sequence.lattice.type;
  for (const Variant& variant : variants()) {
    RenderSettings settings = settingsFor(sequence.scene(), camera, softTransferFunction(type), 38, 30);
    variant.set(settings, type);
    EXPECT_TRUE(framesAreEqual(sequence, settings, variant.options)) << variant.name;
  }
}

std::string parameterName(const testing::TestParamInfo<Parameters>& info) {
  std::string name = std::get<1>(info.param) + "_" + std::to_string(std::get<0>(info.param)) +
                     sequenceNumber(std::get<0>(info.param)).name;
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(AllSequences, DifferentialFrames,
                         testing::Combine(testing::Range(size_t(0), size_t(9)),
                                          testing::Values("x", "iso", "inside", "ortho", "orthoZ", "wide",
                                                          "close")),
                         parameterName);

TEST(DifferentialFrames, EqualTheFullRenderOnEveryInstructionSetAndKernel) {
  std::vector<Isa> isas = supportedIsas();
  isas.push_back(Isa::scalar);
  for (const Isa isa : isas)
    for (const Kernel kernel : {Kernel::fastest, Kernel::general})
      for (const Sequence& sequence : {ballSequence(ElementType::u8), blockSequence(ElementType::f32)})
        for (const bool extras : {false, true}) {
          RenderSettings settings =
              settingsFor(sequence.scene(), "close", softTransferFunction(sequence.lattice.type), 38, 30);
          settings.isa = isa;
          settings.kernel = kernel;
          settings.shade = settings.depth = extras;
          EXPECT_TRUE(framesAreEqual(sequence, settings, withMethod(Method::segments)))
              << name(isa) << ' ' << sequence.name << " extras " << extras;
        }
}

// Such a step is rendered without looking for what it touched; the cached segments must not outlive it.
TEST(DifferentialFrames, OutdoAStepThatChangesEverything) {
  for (const ElementType type : {ElementType::u8, ElementType::f32}) {
    Sequence sequence{"everything", denseNoise(type, 48, 1).lattice, {}};
    const auto withVoxel = [&](Field field, const Vec3i& voxel) {
      applyChanges(changesOf(type, {{voxel, 1}}), field);
      return field;
    };
    const Field first = denseNoise(type, 48, 1).field, second = denseNoise(type, 48, 2).field;
    sequence.steps = {first, withVoxel(first, {4, 5, 6}), second, withVoxel(second, {20, 21, 22}),
                      withVoxel(second, {30, 5, 9})};
    const RenderSettings settings = settingsFor(sequence.scene(), "iso", softTransferFunction(type), 38, 30);
    const std::vector<ChangedVoxels> changes = sequence.changes();
    FramePair frames(sequence.lattice, settings, withMethod(Method::segments));
    EXPECT_TRUE(frames.start(first));
    for (size_t i = 0; i < changes.size(); ++i) {
      EXPECT_TRUE(frames.update(changes[i])) << i;
      const FrameStatistics& statistics = frames.segments().statistics();
      const auto all = uint64_t(frames.segments().image().width * frames.segments().image().height);
      if (i == 1)
        EXPECT_EQ(statistics.pixelsRecast, all);
      else
        EXPECT_LT(statistics.pixelsRecast, all / 4);
    }
  }
}

TEST(DifferentialFrames, DoNotDependOnTheStepARendererStartedFrom) {
  for (size_t number = 0; number < 9; ++number) {
    const Sequence& sequence = sequenceNumber(number);
    RenderSettings settings =
        settingsFor(sequence.scene(), "iso", windowedTransferFunction(sequence.lattice.type), 38, 30);
    settings.depth = true;
    const std::vector<ChangedVoxels> changes = sequence.changes();
    DifferentialRenderer fromStart(sequence.lattice, settings, withMethod(Method::segments));
    fromStart.start(sequence.steps[0]);
    const size_t middle = sequence.steps.size() / 2;
    std::unique_ptr<DifferentialRenderer> fromMiddle;
    for (size_t step = 1; step < sequence.steps.size(); ++step) {
      fromStart.update(changes[step - 1]);
      DifferentialRenderer alone(sequence.lattice, settings, withMethod(Method::full));
      EXPECT_TRUE(imagesEqualBitForBit(fromStart.image(), alone.start(sequence.steps[step])))
          << sequence.name << step;
      if (step > middle) fromMiddle->update(changes[step - 1]);
      if (step == middle) {
        fromMiddle = std::make_unique<DifferentialRenderer>(sequence.lattice, settings,
                                                            withMethod(Method::segments, 2));
        fromMiddle->start(sequence.steps[step]);
      }
      if (!fromMiddle) continue;
      EXPECT_TRUE(imagesEqualBitForBit(fromStart.image(), fromMiddle->image())) << sequence.name << step;
      EXPECT_TRUE(imagesEqualBitForBit(fromStart.depth(), fromMiddle->depth())) << sequence.name << step;
      EXPECT_EQ(fromStart.state(), fromMiddle->state());
    }
  }
}

TEST(DifferentialFrames, EqualTheFullRenderInsideAClipBox) {
  for (const Sequence& sequence : {frontSequence(ElementType::u8), blockSequence(ElementType::u16)}) {
    RenderSettings settings =
        settingsFor(sequence.scene(), "iso", softTransferFunction(sequence.lattice.type), 38, 30);
    const PointBox box = sequence.lattice.worldBounds();
    const Vec3d size = box.hi - box.lo;
    settings.clipBox = PointBox{box.lo + size * 0.21, box.hi - size * 0.33};
    for (const std::string camera : {"x", "iso", "inside", "wide"}) {
      settings.camera = cameraNamed(camera, sequence.lattice);
      EXPECT_TRUE(framesAreEqual(sequence, settings, withMethod(Method::segments, 2)))
          << sequence.name << ' ' << camera;
    }
  }
}

TEST(DifferentialFrames, EqualTheFullRenderUnderARotatedAnisotropicTransform) {
  Sequence sequence = ballSequence(ElementType::f32);
  sequence.lattice.worldFromIndex = {{Vec3d{0.3, 0.1, 0}, Vec3d{-0.1, 0.4, 0.05}, Vec3d{0.02, -0.1, 0.9}},
                                     {5, -3, 2}};
  RenderSettings settings =
      settingsFor(sequence.scene(), "iso", softTransferFunction(ElementType::f32), 38, 30);
  for (const bool shade : {false, true}) {
    settings.shade = shade;
    EXPECT_TRUE(framesAreEqual(sequence, settings, withMethod(Method::segments)));
  }
}

TEST(DifferentialFrames, EqualTheFullRenderAroundABackgroundThatIsNotZero) {
  for (const double background : {0.375, -2.0}) {
    Sequence sequence = ballSequence(ElementType::f32);
    sequence.lattice.background = background;
    for (Field& step : sequence.steps) {
      step.background = background;
      for (float& v : valuesAs<float>(step.values)) v = v == 0 ? float(background) : v;
    }
    for (const RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::average}) {
      RenderSettings settings =
          settingsFor(sequence.scene(), "iso", softTransferFunction(ElementType::f32), 38, 30);
      settings.mode = mode;
      EXPECT_TRUE(framesAreEqual(sequence, settings, withMethod(Method::segments)))
          << background << ' ' << int(mode);
    }
  }
}

uint64_t unlimitedCacheBytes(const Sequence& sequence, const RenderSettings& settings) {
  DifferentialRenderer renderer(sequence.lattice, settings, withMethod(Method::segments));
  renderer.start(sequence.steps[0]);
  return renderer.statistics().cacheBytes;
}

TEST(DifferentialFrames, EqualTheFullRenderWithoutMemoryForACache) {
  const Sequence sequence = ballSequence(ElementType::f32);
  const RenderSettings settings =
      settingsFor(sequence.scene(), "iso", softTransferFunction(ElementType::f32));
  const uint64_t whole = unlimitedCacheBytes(sequence, settings);
  ASSERT_GT(whole, 0u);
  const std::vector<ChangedVoxels> changes = sequence.changes();
  for (const uint64_t limit : {uint64_t(0), uint64_t(1), whole / 3, whole - 1})
    for (const int threads : {1, 2}) {
      RendererOptions options = withMethod(Method::segments, threads);
      options.cacheMemory = limit;
      FramePair pair(sequence.lattice, settings, options);
      ASSERT_TRUE(pair.start(sequence.steps[0])) << limit;
      EXPECT_GT(pair.segments().statistics().tilesUncached, 0u) << limit;
      for (const ChangedVoxels& step : changes) {
        ASSERT_TRUE(pair.update(step)) << limit;
        const FrameStatistics& s = pair.segments().statistics();
        EXPECT_LE(s.cacheBytes, limit);
        EXPECT_EQ(s.cacheBytes > 0, limit >= whole / 3);
        if (limit <= 1) {
          EXPECT_GT(s.tilesUncached, 0u);
        }
      }
    }
}

TEST(DifferentialFrames, EqualTheFullRenderWhereSegmentListsWouldNotFit) {
  // So long a domain and so large an image that the lists are walked anew in every frame.
  const Lattice lattice = sparseLattice(ElementType::u8, {16000, 24, 24});
  VoxelMap voxels;
  for (int i = 0; i < 500; ++i) voxels[{31 * i + 5, i % 24, 8 + i % 8}] = 255;
  const Sequence sequence{
      "thread",
      lattice,
      {fieldOf(lattice, voxels), fieldOf(lattice, filled({{7000, 0, 0}, {7400, 24, 24}}, 200))}};
  RenderSettings settings =
      settingsFor(sequence.scene(), "-y", opaqueTransferFunction(ElementType::u8), 1480, 1480);
  settings.camera.target = settings.camera.target + Vec3d{0, 0, 1e-3};
  settings.step = 4;
  EXPECT_TRUE(framesAreEqual(sequence, settings, withMethod(Method::segments, 2)));
  DifferentialRenderer renderer(lattice, settings, withMethod(Method::segments, 2));
  EXPECT_TRUE(renderer.seesVolume());
  renderer.start(sequence.steps[0]);
  EXPECT_GT(renderer.statistics().samples, 0u);
}

}  // namespace
}  // namespace kairos::test
