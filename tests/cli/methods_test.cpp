// The methods of `kairos render` that project changed voxels to pixels, and their budgets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/render_fixture.h"

namespace kairos::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class Methods : public Render {
 protected:
  const Arguments look{"--float", "--range", "0,255"};

  std::vector<nlohmann::json> stats(const std::string& out, const Arguments& options) {
    const std::string file = dir / (out + ".jsonl");
    EXPECT_TRUE(ok(render(out, join(join(look, options), {"--stats", file}))));
    return records(file);
  }
};

TEST_F(Methods, ThePublishedMethodsGiveTheBitsOfAFullRender_D3) {
  stats("full", {"--method", "full"});
  const auto dvrm = stats("dvrm", {"--method", "dvrm"});
  const auto tldvrm = stats("tldvrm", {"--method", "tldvrm", "--order", "zero", "--threads", "2"});
  const auto tcdvrm = stats("tcdvrm", {"--method", "tcdvrm"});  // no limit
  for (const char* method : {"dvrm", "tldvrm", "tcdvrm"}) expectSameFrames("full", method);
  for (size_t step = 1; step < dvrm.size(); ++step) {
    EXPECT_EQ(dvrm[step]["voxels_sampled"], dvrm[step]["voxels_changed"]);
    EXPECT_GT(dvrm[step]["pixels_influenced"], 0);
    EXPECT_LT(dvrm[step]["pixels_recast"], 48 * 40);
    EXPECT_GE(dvrm[step]["pixels_recast"], dvrm[step]["pixels_influenced"]);
    EXPECT_GT(dvrm[step]["ray_points"], 0);
    for (const char* term : {"load_ms", "update_ms", "select_ms", "cast_ms", "predicted_ms"})
      EXPECT_GE(dvrm[step][term], 0) << term;
    EXPECT_EQ(tcdvrm[step]["voxels_sampled"], tcdvrm[step]["voxels_changed"]);
  }
  EXPECT_EQ(tldvrm[1]["voxels_sampled"], tldvrm[1]["voxels_changed"]);
  EXPECT_LT(tldvrm[2]["voxels_sampled"],
            tldvrm[1]["voxels_changed"].get<int>() + tldvrm[2]["voxels_changed"].get<int>());
}

TEST_F(Methods, ABudgetOfSamplesIsKeptAndRepeatsBitForBit_D10) {
  const Arguments budget{"--method", "tcdvrm", "--budget", "samples:2e3", "--seed", "5"};
  const auto all = stats("one", join(budget, {"--threads", "1"}));
  stats("two", join(budget, {"--threads", "2"}));
  expectSameFrames("one", "two");
  for (size_t step = 1; step < all.size(); ++step) {
    EXPECT_EQ(all[step]["budget_samples"], 2000);
    EXPECT_LT(all[step]["voxels_sampled"], all[step]["voxels_changed"]);
    EXPECT_GT(all[step]["stale_pixels"], 0);
  }
  stats("other", {"--method", "tcdvrm", "--budget", "samples:2e3", "--seed", "6"});
  EXPECT_FALSE(image("one", kFirstStep + 2) == image("other", kFirstStep + 2));
}

TEST_F(Methods, EveryOptionOfTheTimeCriticalMethodIsTaken_D9) {
  const auto all =
      stats("all", {"--method", "tcdvrm", "--budget", "25fps", "--lom", "magnitude", "--projection", "paper",
                    "--order", "trilinear", "--carry-over", "--cut-off", "--no-calibration", "--seed", "3"});
  EXPECT_EQ(all[0]["budget_ms"], 40);
  const auto error = stats("error", {"--budget", "error:1e-2"});
  EXPECT_EQ(error[0]["method"], "anytime");
  EXPECT_EQ(error[0]["budget_error"], 1e-2);
  const auto time = stats("time", {"--method", "tcdvrm", "--budget", "12.5ms"});
  EXPECT_EQ(time[0]["budget_ms"], 12.5);
  EXPECT_TRUE(time[1].contains("predicted_ms"));
}

TEST_F(Methods, InfluenceAndSamplingPointsBecomeChannels_D16) {
  using namespace std::string_literals;
  stats("out", {"--method", "dvrm", "--aov", "influence,samples,depth,age"});
  const std::string header = fileContents(frame("out", kFirstStep + 1));
  for (const std::string channel :
       {"influence\0\2\0\0\0"s, "samples\0\2\0\0\0"s, "age\0\2\0\0\0"s, "Z\0\2\0\0\0"s})
    EXPECT_THAT(header, HasSubstr(channel));
}

TEST_F(Methods, SummariesSayWhatWasProjected) {
  const ProgramResult dvrm = render("a", {"--method", "dvrm", "--range", "0,255"});
  EXPECT_THAT(dvrm.out, HasSubstr("100 % of the changed voxels"));
  EXPECT_THAT(dvrm.out, HasSubstr("same bits as a full render"));
  const ProgramResult paper = render("b", {"--method", "dvrm", "--projection", "paper", "--range", "0,255"});
  EXPECT_THAT(paper.out, Not(HasSubstr("same bits as a full render")));
}

TEST_F(Methods, OptionsThatAMethodDoesNotKnowAreNamed) {
  const auto refused = [&](const Arguments& options, const char* option, const char* methods) {
    const ProgramResult result = render("no", options);
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_THAT(result.err, HasSubstr(option));
    EXPECT_THAT(result.err, HasSubstr(methods));
  };
  refused({"--budget", "40ms", "--method", "dvrm"}, "--budget", "tcdvrm");
  refused({"--projection", "paper"}, "--projection", "dvrm");
  refused({"--order", "zero", "--method", "full"}, "--order", "dvrm");
  refused({"--method", "tldvrm", "--lom", "magnitude"}, "--lom", "tcdvrm");
  refused({"--carry-over"}, "--carry-over", "tcdvrm");
}

// Pixels that an inexact method left are not taken for those of another run.
TEST_F(Methods, AResumedRunKeepsOnlyFramesOfTheSameMethod) {
  const Arguments budget{"--method", "tcdvrm", "--budget", "samples:2e3"};
  ASSERT_TRUE(ok(render("out", join(look, budget))));
  EXPECT_THAT(render("out", join(join(look, budget), {"--resume"})).out, HasSubstr("kept 6 frames"));
  EXPECT_THAT(render("out", join(look, {"--method", "full", "--resume"})).out, Not(HasSubstr("kept")));
  EXPECT_THAT(render("out", join(look, {"--method", "dvrm", "--resume"})).out, HasSubstr("kept 6 frames"));
}

}  // namespace
}  // namespace kairos::test
