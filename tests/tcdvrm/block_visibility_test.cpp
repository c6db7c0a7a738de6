// Blocks that are said to be blank, or to show what they showed before, are and do.
#include "tcdvrm/block_visibility.h"

#include <gtest/gtest.h>

#include "jet_sequence.h"

namespace kairos::test {
namespace {

class BlockVisibilityOf : public testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  RenderSettings settings() const {
    const auto [view, kind] = GetParam();
    RenderSettings s = settingsFor(jet1(40), view, windowedTransferFunction(ElementType::u8), 100, 84);
    s.shade = kind == std::string("shaded");
    s.preintegrated = kind == std::string("preintegrated");
    if (kind == std::string("error")) s.error = 1e-3;
    return s;
  }
};

bool sameInBlock(const Image& a, const Image& b, size_t column, size_t row) {
  for (int y = int(row) * kBlockEdge; y < std::min(int(row + 1) * kBlockEdge, a.height); ++y)
    for (int x = int(column) * kBlockEdge; x < std::min(int(column + 1) * kBlockEdge, a.width); ++x)
      if (!std::equal(a.pixel(x, y), a.pixel(x, y) + 4, b.pixel(x, y))) return false;
  return true;
}

TEST_P(BlockVisibilityOf, BlankBlocksAreBlankAndUntouchedOnesUnchanged) {
  const JetSequence sequence = jetSequence(20, 28);
  ThreadPool pool(2);
  SceneState scene(sequence.lattice, settings(), pool);
  scene.start(sequence.start);
  const auto full = makeRenderer(sequence.lattice, settings(), withBudget(Method::full, {}));
  Image before = full->start(sequence.start);
  const TileCaster caster(scene.settings(), scene.volume(), pool);
  ASSERT_TRUE(caster.index());
  BlockVisibility visibility(caster, scene);
  visibility.restart();
  const Image blank(before.width, before.height, 4);
  size_t blankBlocks = 0, untouched = 0, all = 0;
  for (const ChangedVoxels& changes : sequence.changes) {
    const AppliedChanges applied = scene.apply(changes);
    const BlockSet touched = visibility.follow(applied);
    const BlockSet visible = visibility.blocks();
    const Image& now = full->update(changes);
    for (size_t b = 0; b < touched.size(); ++b, ++all) {
      const size_t column = b % size_t(touched.columns()), row = b / size_t(touched.columns());
      EXPECT_EQ(visible.contains(b), visibility.visible(b));
      EXPECT_TRUE(visible.contains(b) || sameInBlock(now, blank, column, row)) << b;
      EXPECT_TRUE(touched.contains(b) || sameInBlock(now, before, column, row)) << b;
      blankBlocks += !visible.contains(b);
      untouched += !touched.contains(b);
    }
    before = now;
  }
  // Slabs are judged by whole bricks, of which the jet has few.
  const size_t least = settings().slabs() ? 1 : all / 10;
  EXPECT_GE(blankBlocks, least);
  EXPECT_GE(untouched, least);
}

TEST_P(BlockVisibilityOf, FollowingTheStepsEqualsStartingAnew) {
  const JetSequence sequence = jetSequence(30, 36);
  ThreadPool pool(1);
  SceneState scene(sequence.lattice, settings(), pool);
  scene.start(sequence.start);
  const TileCaster caster(scene.settings(), scene.volume(), pool);
  BlockVisibility followed(caster, scene);
  followed.restart();
  for (const ChangedVoxels& changes : sequence.changes) followed.follow(scene.apply(changes));
  BlockVisibility anew(caster, scene);
  anew.restart();
  for (size_t b = 0; b < followed.blocks().size(); ++b) EXPECT_EQ(followed.visible(b), anew.visible(b)) << b;
}

INSTANTIATE_TEST_SUITE_P(Views, BlockVisibilityOf,
                         testing::Combine(testing::Values("ortho", "iso", "close", "inside"),
                                          testing::Values("plain", "shaded", "preintegrated", "error")));

}  // namespace
}  // namespace kairos::test
