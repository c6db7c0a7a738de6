// `kairos lod`: its options, and that a played sequence shows what `kairos render` shows.
#include <cstdlib>

#include "cli/render_fixture.h"

namespace kairos::test {
namespace {

using testing::HasSubstr;

class Lod : public Render {
 protected:
  // Skips, with the reason, where there is no OpenGL; REQUIRE_GL=1 makes that a failure.
  bool lod(const std::string& out, const Arguments& options) const {
    const ProgramResult result = run(
        join({"lod", dir / "seq", "-o", dir / (out + "/f.####.exr"), "--size", "48x40", "--float"}, options));
    const char* required = std::getenv("REQUIRE_GL");
    const bool optional = !required || std::string(required) != "1";
    if (optional && result.err.find("no OpenGL") != std::string::npos) {
      reason = result.err;
      return false;
    }
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return true;
  }
  mutable std::string reason;

  static int pixelsThatDiffer(const Image& a, const Image& b) {
    int count = 0;
    for (size_t p = 0; p < a.data.size(); p += 4) {
      bool differs = false;
      for (size_t c = 0; c < 4; ++c) differs |= std::abs(a.data[p + c] - b.data[p + c]) > 2e-4f;
      count += differs;
    }
    return count;
  }
};

TEST_F(Lod, PlaysASequenceAsRenderShowsIt) {
  makeSequence();
  if (!lod("lod",
           {"--slices", "shells", "--stats", dir / "lod.jsonl", "--png", "--subvolume-memory", "40KiB"}))
    GTEST_SKIP() << reason;
  ASSERT_TRUE(ok(render("full", {"--float", "--terminate", "1"})));
  for (int step = kFirstStep; step < kFirstStep + kSteps; ++step) {
    // All but samples within rounding of the volume's faces, which one may take and the other not.
    EXPECT_LE(pixelsThatDiffer(image("lod", step), image("full", step)), 10) << "step " << step;
    EXPECT_TRUE(showsSomething(image("lod", step)));
  }
  const auto all = records(dir / "lod.jsonl");
  ASSERT_EQ(all.size(), size_t(kSteps));
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i]["frame"], kFirstStep + int(i));
    EXPECT_EQ(all[i]["method"], "lod-none");
    // The first frame was rendered before; each further one loads what the ball touched.
    EXPECT_LT(all[i]["texture_bytes_loaded"].get<uint64_t>(), 40u * 40 * 40);
    EXPECT_EQ(all[i]["texture_bytes_loaded"].get<uint64_t>() == 0, i == 0);
  }
}

TEST_F(Lod, LevelsAreKeptBesideTheSequence) {
  makeSequence();
  if (!lod("a", {"--stats", dir / "a.jsonl"})) GTEST_SKIP() << reason;
  EXPECT_EQ(records(dir / "a.jsonl")[0]["levels_reused"], false);
  ASSERT_TRUE(lod("b", {"--stats", dir / "b.jsonl"}));
  EXPECT_EQ(records(dir / "b.jsonl")[0]["levels_reused"], true);
  expectSameFrames("a", "b");
}

TEST_F(Lod, KeepsABudgetAndSaysHow) {
  makeSequence();
  if (!lod("out", {"--budget", "2s", "--importance", "distance,area:2,gaze", "--gaze", "10,10", "--stats",
                   dir / "s.jsonl"}))
    GTEST_SKIP() << reason;
  for (const auto& record : records(dir / "s.jsonl")) {
    EXPECT_EQ(record["budget_ms"], 2000);
    EXPECT_EQ(record["infeasible"], false);
    EXPECT_GT(record["slices"], 0);
  }
  ASSERT_TRUE(lod("tiny", {"--budget", "1000000fps", "--stats", dir / "t.jsonl"}));
  for (const auto& record : records(dir / "t.jsonl")) EXPECT_EQ(record["infeasible"], true);
}

TEST_F(Lod, EveryControllerAndModeRenders) {
  makeSequence();
  for (const Arguments& options : {Arguments{"--controller", "slices", "--budget", "1s"},
                                   {"--controller", "feedback", "--budget", "25fps"},
                                   {"--controller", "tolerance", "--lod-tolerance", "0.05"},
                                   {"--mode", "mip"},
                                   {"--blend", "back-to-front"},
                                   {"--ortho", "fit", "--coherence", "10", "--budget", "1s"}}) {
    if (!lod("out", join({"--frames", "3"}, options))) GTEST_SKIP() << reason;
    EXPECT_TRUE(showsSomething(image("out", kFirstStep))) << options[1];
  }
}

TEST_F(Lod, RefusesWhatItCannotDo) {
  const auto refusal = [&](const Arguments& options) {
    const ProgramResult result =
        run(join(join({"lod", dir / "sim", "-o", dir / "x.####.exr", "--range", "0,255"}, raw), options));
    EXPECT_EQ(result.exitCode, 2) << result.out;
    return result.err;
  };
  EXPECT_THAT(refusal({"--shade"}), HasSubstr("--shade"));
  EXPECT_THAT(refusal({"--mode", "average"}), HasSubstr("dvr and mip"));
  EXPECT_THAT(refusal({"--budget", "40"}), HasSubstr("40ms"));
  EXPECT_THAT(refusal({"--budget", "-1ms"}), HasSubstr("--budget"));
  EXPECT_THAT(refusal({"--controller", "slices"}), HasSubstr("--budget"));
  EXPECT_THAT(refusal({"--controller", "none", "--budget", "1s"}), HasSubstr("not kept"));
  EXPECT_THAT(refusal({"--importance", "beauty"}), HasSubstr("opacity"));
  EXPECT_THAT(refusal({"--gaze", "3,4"}), HasSubstr("--importance gaze"));
}

}  // namespace
}  // namespace kairos::test
