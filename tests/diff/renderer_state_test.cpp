// Which fields and changes a renderer accepts, and that a refusal leaves everything as it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "sequences.h"

namespace kairos::test {
namespace {

using testing::HasSubstr;

class Refusals : public testing::Test {
 protected:
  Refusals() {
    renderer_.start(sequence_.steps[0]);
    before_ = renderer_.image();
  }

  /// `action` throws StateError; afterwards the frame is what it was, and the right changes still apply.
  template <class Action>
  std::string refusal(Action&& action) {
    std::string message = "nothing was thrown";
    try {
      action();
    } catch (const StateError& e) {
      message = e.what();
    }
    EXPECT_TRUE(imagesEqualBitForBit(renderer_.image(), before_));
    EXPECT_EQ(renderer_.state(), stateChecksum(sequence_.steps[0]));
    renderer_.update(changes_[0]);
    DifferentialRenderer full(sequence_.lattice, settings_, withMethod(Method::full));
    EXPECT_TRUE(imagesEqualBitForBit(renderer_.image(), full.start(sequence_.steps[1])));
    return message;
  }

  Sequence sequence_ = ballSequence(ElementType::u16);
  std::vector<ChangedVoxels> changes_ = sequence_.changes();
  RenderSettings settings_ = settingsFor(sequence_.scene(), "iso", softTransferFunction(ElementType::u16));
  DifferentialRenderer renderer_{sequence_.lattice, settings_, withMethod(Method::segments)};
  Image before_;
};

TEST_F(Refusals, ChangesOfAnotherState) {
  EXPECT_THAT(refusal([&] { renderer_.update(changes_[1]); }),
              HasSubstr(std::to_string(*changes_[1].stateBefore)));
}

TEST_F(Refusals, ChangesOfTheSameStepTwice) {
  renderer_.update(changes_[0]);
  EXPECT_THROW(renderer_.update(changes_[0]), StateError);
  renderer_.update(changes_[1]);
  EXPECT_EQ(renderer_.state(), stateChecksum(sequence_.steps[2]));
}

TEST_F(Refusals, ChangesOutsideTheDomain) {
  const Vec3i outside = sequence_.lattice.domain.hi;
  EXPECT_THAT(
      refusal([&] {
        renderer_.update(changesOf(ElementType::u16, {{sequence_.lattice.domain.lo, 9}, {outside, 9}}));
      }),
      HasSubstr(std::to_string(outside.x)));
}

TEST_F(Refusals, ChangesFarOutsideTheGrid) {
  EXPECT_THAT(refusal([&] {
                renderer_.update(changesOf(ElementType::u16, {{{1000000, -1000000, 5}, 9}}));
              }),
              HasSubstr("1000000"));
}

TEST_F(Refusals, ChangesOfAnotherType) {
  EXPECT_THAT(refusal([&] {
                renderer_.update(changesOf(ElementType::u8, {{sequence_.lattice.domain.lo, 9}}));
              }),
              testing::AllOf(HasSubstr("u8"), HasSubstr("u16")));
}

TEST_F(Refusals, ChangesWhoseValuesAreMissing) {
  ChangedVoxels cut = changesOf(ElementType::u16, {{sequence_.lattice.domain.lo, 9},
                                                   {sequence_.lattice.domain.lo + Vec3i{1, 0, 0}, 9}});
  valuesAs<uint16_t>(cut.values).pop_back();
  EXPECT_THAT(refusal([&] { renderer_.update(cut); }), HasSubstr("value"));
}

TEST_F(Refusals, ChangedLeavesThatStandBetweenLeaves) {
  ChangedVoxels shifted = changesOf(ElementType::u16, {{sequence_.lattice.domain.lo + Vec3i{9, 9, 9}, 9}});
  shifted.leaves[0].origin.x += 3;
  EXPECT_THAT(refusal([&] { renderer_.update(shifted); }), HasSubstr("8"));
}

TEST_F(Refusals, AFieldOfAnotherType) {
  EXPECT_THAT(refusal([&] { renderer_.start(ballSequence(ElementType::u8).steps[0]); }), HasSubstr("u8"));
}

TEST_F(Refusals, AFieldThatReachesOutOfTheDomain) {
  Field wide = sequence_.steps[1];
  applyChanges(changesOf(ElementType::u16, {{sequence_.lattice.domain.hi, 9}}), wide);
  EXPECT_THAT(refusal([&] { renderer_.start(wide); }), HasSubstr("domain"));
}

TEST_F(Refusals, AFieldOfAnotherBackground) {
  Field other = sequence_.steps[1];
  other.background = 3;
  EXPECT_THAT(refusal([&] { renderer_.start(other); }), HasSubstr("background"));
}

TEST_F(Refusals, AnArrayOfAnotherType) {
  const std::vector<float> array(size_t(sequence_.lattice.domain.voxelCount()));
  EXPECT_THAT(refusal([&] { renderer_.render(array.data()); }),
              testing::AllOf(HasSubstr("f32"), HasSubstr("u16")));
}

TEST(DifferentialRenderer, RefusesChangesBeforeAnyField) {
  const Sequence sequence = ballSequence(ElementType::u8);
  DifferentialRenderer renderer(
      sequence.lattice, settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::u8)), {});
  EXPECT_THROW(renderer.update(sequence.changes()[0]), StateError);
  EXPECT_EQ(renderer.state(), std::nullopt);
  renderer.start(sequence.steps[0]);
  EXPECT_NO_THROW(renderer.update(sequence.changes()[0]));
}

TEST(DifferentialRenderer, FollowsTheStateWhereItIsKnown) {
  const Sequence sequence = ballSequence(ElementType::u8);
  std::vector<ChangedVoxels> changes = sequence.changes();
  DifferentialRenderer renderer(
      sequence.lattice, settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::u8)), {});
  renderer.start(sequence.steps[0]);
  EXPECT_EQ(renderer.state(), stateChecksum(sequence.steps[0]));
  renderer.update(changes[0]);
  EXPECT_EQ(renderer.state(), changes[0].stateAfter);
  changes[1].stateAfter.reset();
  renderer.update(changes[1]);
  EXPECT_EQ(renderer.state(), std::nullopt);
  renderer.update(changes[2]);
  EXPECT_EQ(renderer.state(), stateChecksum(sequence.steps[3]));
}

TEST(DifferentialRenderer, StartsAnewFromAnyField) {
  const Sequence balls = ballSequence(ElementType::u8);
  const RenderSettings settings =
      settingsFor(balls.scene(), "iso", windowedTransferFunction(ElementType::u8));
  FramePair pair(balls.lattice, settings, withMethod(Method::segments));
  ASSERT_TRUE(pair.start(balls.steps[0]));
  ASSERT_TRUE(pair.update(balls.changes()[0]));
  for (const size_t step : {5u, 2u}) {
    ASSERT_TRUE(pair.start(balls.steps[step]));
    DifferentialRenderer fresh(balls.lattice, settings, {});
    EXPECT_TRUE(imagesEqualBitForBit(pair.segments().image(), fresh.start(balls.steps[step])));
    EXPECT_TRUE(pair.update(balls.changes()[step]));
  }
}

TEST(DifferentialRenderer, MissingTheVolumeSaysSoAndShowsNothing) {
  const Sequence sequence = noiseSequence(ElementType::u8);
  RenderSettings settings = settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::u8));
  settings.depth = true;
  EXPECT_TRUE(DifferentialRenderer(sequence.lattice, settings, {}).seesVolume());
  std::swap(settings.camera.eye, settings.camera.target);
  settings.camera.target = settings.camera.eye * 2.0 - settings.camera.target;
  settings.camera.eye = settings.camera.target * 2.0 - settings.camera.eye;
  settings.camera.target = settings.camera.eye * 2.0 - settings.camera.target;
  RenderSettings clipped = settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::u8));
  clipped.clipBox = PointBox{{1000, 1000, 1000}, {1001, 1001, 1001}};
  clipped.depth = true;
  for (const RenderSettings& missing : {settings, clipped}) {
    FramePair pair(sequence.lattice, missing, withMethod(Method::segments));
    EXPECT_FALSE(pair.segments().seesVolume());
    ASSERT_TRUE(pair.start(sequence.steps[0]));
    ASSERT_TRUE(pair.update(sequence.changes()[0]));
    EXPECT_EQ(pair.segments().statistics().tilesRecast, 0u);
    for (const float c : pair.segments().image().data) ASSERT_EQ(c, 0);
    for (const float d : pair.segments().depth().data) ASSERT_EQ(d, std::numeric_limits<float>::infinity());
  }
}

TEST(DifferentialRenderer, AnEmptyDomainShowsNothing) {
  Lattice lattice = denseLattice(ElementType::u8, {0, 0, 0});
  RenderSettings settings;
  settings.width = settings.height = 8;
  settings.camera = fittedCamera("iso", lattice.worldBounds(), 30, 1);
  settings.transferFunction = softTransferFunction(ElementType::u8);
  settings.range = {0, 255};
  DifferentialRenderer renderer(lattice, settings, {});
  renderer.start(fieldOf(lattice, {}));
  for (const float c : renderer.image().data) EXPECT_EQ(c, 0);
  EXPECT_THROW(renderer.update(changesOf(ElementType::u8, {{{0, 0, 0}, 255}})), StateError);
}

TEST(DifferentialRenderer, NamesTheSettingThatIsOutOfRange) {
  const Sequence sequence = ballSequence(ElementType::u8);
  RenderSettings settings = settingsFor(sequence.scene(), "iso", softTransferFunction(ElementType::u8));
  settings.step = 0;
  try {
    DifferentialRenderer renderer(sequence.lattice, settings, {});
    FAIL() << "nothing was thrown";
  } catch (const OptionError& e) {
    EXPECT_THAT(e.what(), HasSubstr("--step"));
  }
  settings.step = 1;
  RendererOptions options;
  options.tilesPerTask = 0;
  EXPECT_THROW(DifferentialRenderer(sequence.lattice, settings, options), OptionError);
}

TEST(DifferentialRenderer, ReportsItsMemory) {
  const Sequence sequence = ballSequence(ElementType::u8);
  const RenderSettings settings = settingsFor(sequence.scene(), "iso", softTransferFunction(ElementType::u8));
  DifferentialRenderer segments(sequence.lattice, settings, withMethod(Method::segments));
  DifferentialRenderer full(sequence.lattice, settings, withMethod(Method::full));
  segments.start(sequence.steps[0]);
  full.start(sequence.steps[0]);
  EXPECT_GT(segments.statistics().cacheBytes, 0u);
  EXPECT_EQ(full.statistics().cacheBytes, 0u);
  EXPECT_GT(segments.memoryBytes(), full.memoryBytes() + segments.statistics().cacheBytes);
  EXPECT_GE(full.memoryBytes(), full.volume().memoryBytes());
}

}  // namespace
}  // namespace kairos::test
