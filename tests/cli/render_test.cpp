// `kairos render` from end to end, through the program.
#include "cli/render_fixture.h"

#include "core/image_difference.h"

#include <limits>
#include <thread>

namespace kairos::test {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST_F(Render, EveryMethodAndSourceGivesTheSameBits) {
  makeSequence();
  const Arguments look{"--shade", "--float", "--step", "0.7"};
  ASSERT_TRUE(ok(render("full", join(look, {"--method", "full"}))));
  ASSERT_TRUE(ok(render("direct", look)));
  ASSERT_TRUE(ok(renderInput(dir / "seq", "sequence", join(look, {"--threads", "2"}))));
  ASSERT_TRUE(
      ok(renderInput(dir / "seq", "uncached", join(look, {"--cache-memory", "0", "--threads", "1"}))));
  EXPECT_TRUE(showsSomething(image("full", kFirstStep)));
  EXPECT_FALSE(image("full", 3) == image("full", 6)) << "the scene does not change";
  for (const char* other : {"direct", "sequence", "uncached"}) expectSameFrames("full", other);
}

TEST_F(Render, ASingleFrameNeedsNoPlaceForTheStep) {
  const ProgramResult all =
      run(join({"render", dir / "sim", "-o", dir / "all/f.####.exr", "--range", "0,255"}, raw));
  ASSERT_EQ(all.exitCode, 0) << all.err;
  const ProgramResult one =
      run(join({"render", dir / "sim", "-o", dir / "still.exr", "--frames", "4", "--range", "0,255"}, raw));
  ASSERT_EQ(one.exitCode, 0) << one.err;
  EXPECT_TRUE(readImage(dir / "still.exr") == image("all", 4));
}

TEST_F(Render, FramesMayStartInTheMiddle) {
  makeSequence();
  ASSERT_TRUE(ok(renderInput(dir / "seq", "all", {})));
  ASSERT_TRUE(ok(renderInput(dir / "seq", "some", {"--frames", "5-6"})));
  ASSERT_TRUE(ok(render("direct", {"--frames", "7-"})));
  EXPECT_THAT(fileNames(dir / "some"), ElementsAre("f.0005.exr", "f.0006.exr"));
  EXPECT_THAT(fileNames(dir / "direct"), ElementsAre("f.0007.exr", "f.0008.exr"));
  for (int step : {5, 6}) EXPECT_TRUE(image("some", step) == image("all", step));
  for (int step : {7, 8}) EXPECT_TRUE(image("direct", step) == image("all", step));
}

TEST_F(Render, FilesOutsideTheAskedFramesAreNotReadWhenTheRangeIsGiven) {
  ASSERT_TRUE(ok(render("all", {"--range", "0,255", "--stats", dir / "all.jsonl"})));
  ASSERT_TRUE(ok(render("one", {"--range", "0,255", "--frames", "4", "--stats", dir / "one.jsonl"})));
  ASSERT_EQ(records(dir / "one.jsonl").size(), 1u);
  EXPECT_EQ(records(dir / "one.jsonl")[0]["bytes_read"], kEdge * kEdge * kEdge);
  EXPECT_TRUE(image("one", 4) == image("all", 4));
}

TEST_F(Render, TheToleranceOfDirectInputIsThatOfTheStaticPhase) {
  makeSequence({"--tolerance", "30"});
  ASSERT_TRUE(ok(render("direct", {"--tolerance", "30", "--range", "0,255"})));
  ASSERT_TRUE(ok(render("exact", {"--range", "0,255"})));
  ASSERT_TRUE(ok(renderInput(dir / "seq", "sequence", {"--range", "0,255"})));
  expectSameFrames("direct", "sequence");
  EXPECT_FALSE(image("direct", 8) == image("exact", 8));
}

TEST_F(Render, ResumeRendersOnlyWhatIsMissingOrDamaged) {
  makeSequence();
  ASSERT_TRUE(ok(renderInput(dir / "seq", "reference", {"--png"})));
  ASSERT_TRUE(ok(renderInput(dir / "seq", "out", {"--png"})));
  fs::remove(frame("out", 4));
  fs::remove(dir / "out/f.0006.png");
  fs::resize_file(frame("out", 7), fs::file_size(frame("out", 7)) / 2);
  const auto past = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (int step : {3, 5, 6, 7, 8}) fs::last_write_time(frame("out", step), past);
  const ProgramResult result = renderInput(dir / "seq", "out", {"--png", "--resume"});
  ASSERT_TRUE(ok(result));
  EXPECT_THAT(result.out, HasSubstr("3 frames"));
  for (int step : {3, 5, 8}) EXPECT_EQ(fs::last_write_time(frame("out", step)), past) << step;
  for (int step : {6, 7}) EXPECT_NE(fs::last_write_time(frame("out", step)), past) << step;
  expectSameFrames("out", "reference");
}

TEST_F(Render, ResumeWithOtherSettingsRendersEverythingAnew) {
  ASSERT_TRUE(ok(render("out", {"--view", "x"})));
  ASSERT_TRUE(ok(render("out", {"--view", "y", "--resume"})));
  ASSERT_TRUE(ok(render("reference", {"--view", "y"})));
  expectSameFrames("out", "reference");
}

TEST_F(Render, ResumeKnowsWhenTheInputChanged) {
  ASSERT_TRUE(ok(render("out", {"--range", "0,255"})));
  writeRawFile(dir / "sim/ball_0005.raw", sceneAt<uint8_t>(9));
  ASSERT_TRUE(ok(render("out", {"--range", "0,255", "--resume"})));
  ASSERT_TRUE(ok(render("reference", {"--range", "0,255"})));
  expectSameFrames("out", "reference");
}

TEST_F(Render, ResumeWithNothingLeftToDoKeepsEveryFrame) {
  ASSERT_TRUE(ok(render("out", {})));
  const auto before = fs::last_write_time(frame("out", 8));
  const ProgramResult result = render("out", {"--resume"});
  ASSERT_TRUE(ok(result));
  EXPECT_THAT(result.out, HasSubstr("kept 6 frames"));
  EXPECT_EQ(fs::last_write_time(frame("out", 8)), before);
}

// Sends `signal` as soon as `path` stands.
RunOptions interruptAt(const std::string& path, int signal) {
  RunOptions options;
  options.whileRunning = [=](pid_t child) {
    for (int i = 0; i < 20000 && !fs::exists(path) && ::kill(child, 0) == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(child, signal);
  };
  return options;
}

TEST_F(Render, AnInterruptedRunKeepsItsFramesAndResumes) {
  const Arguments slow{"--method", "full",   "--threads", "1",       "--step",
                       "0.05",     "--size", "192x192",   "--range", "0,255"};
  const Arguments all = join(join({"render", dir / "sim"}, raw), slow);
  const auto to = [&](const std::string& out, const Arguments& more) {
    return join(join(all, {"-o", dir / (out + "/f.####.exr")}), more);
  };
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string out = "out" + std::to_string(signal);
    const ProgramResult result = run(to(out, {}), interruptAt(frame(out, kFirstStep), signal));
    EXPECT_EQ(result.exitCode, 130) << result.err;
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_THAT(result.err, HasSubstr("--resume"));
    const auto names = fileNames(dir / out);
    EXPECT_THAT(names, Contains("f.0003.exr"));
    EXPECT_LT(names.size(), size_t(kSteps)) << "the run was over before the signal came";
    for (const std::string& name : names) EXPECT_THAT(name, Not(HasSubstr("tmp")));
  }
  ASSERT_TRUE(ok(run(to("out" + std::to_string(SIGINT), {"--resume"}))));
  ASSERT_TRUE(ok(run(to("reference", {}))));
  expectSameFrames("out" + std::to_string(SIGINT), "reference");
}

TEST_F(Render, StatsHoldOneRecordPerFrame) {
  makeSequence();
  ASSERT_TRUE(ok(renderInput(dir / "seq", "out",
                             {"--stats", dir / "s.jsonl", "--threads", "2", "--shade", "--isa", "scalar"})));
  const auto all = records(dir / "s.jsonl");
  ASSERT_EQ(all.size(), size_t(kSteps));
  for (const char* key : {"frame",          "method",
                          "total_ms",       "load_ms",
                          "update_ms",      "select_ms",
                          "cast_ms",        "compose_ms",
                          "write_ms",       "voxels_changed",
                          "voxels_sampled", "pixels_changed",
                          "pixels_recast",  "segments_total",
                          "segments_dirty", "segments_recast",
                          "samples",        "bricks_visible",
                          "bricks_skipped", "gradients",
                          "bytes_read",     "stale_pixels",
                          "rays_cast",      "step_level",
                          "threads",        "isa",
                          "non_finite"})
    for (const auto& record : all) EXPECT_TRUE(record.contains(key)) << key;
  for (int i = 0; i < kSteps; ++i) EXPECT_EQ(all[size_t(i)]["frame"], kFirstStep + i);
  EXPECT_EQ(all[0]["method"], "segments");
  EXPECT_EQ(all[0]["isa"], "scalar");
  EXPECT_EQ(all[0]["threads"], 2);
  EXPECT_GT(all[0]["gradients"], 0);
  EXPECT_GT(all[1]["bytes_read"], 0);
  EXPECT_GT(all[1]["voxels_changed"], 0);
}

TEST_F(Render, AFrameUnderABudgetSaysWhatItCostAndHowWrongItMayBe) {
  ASSERT_TRUE(ok(render("out", {"--budget", "samples:3000", "--verify", "--stats", dir / "s.jsonl", "--range",
                                "0,255", "--aov", "error,age,level", "--seed", "4", "--float"})));
  ASSERT_TRUE(ok(render("exact", {"--range", "0,255", "--float"})));
  const auto all = records(dir / "s.jsonl");
  ASSERT_EQ(all.size(), size_t(kSteps));
  EXPECT_EQ(all[0]["true_error"], 0) << "the first frame is exact";
  for (const auto& record : all) {
    EXPECT_EQ(record["method"], "anytime");
    EXPECT_EQ(record["budget_samples"], 3000);
    for (const char* key : {"render_ms", "error_estimate", "error_low", "error_high", "true_error",
                            "step_level", "budget_too_small"})
      EXPECT_TRUE(record.contains(key)) << key;
    EXPECT_LT(record["true_error"], 0.1);
  }
  const Metadata metadata = readMetadata(frame("out", kFirstStep + 2));
  EXPECT_EQ(std::get<std::string>(metadata.at("kairos:budget")), "samples:3000");
  for (const char* key : {"kairos:errorEstimate", "kairos:errorLow", "kairos:errorHigh", "kairos:trueError"})
    EXPECT_TRUE(metadata.count(key)) << key;
  const double truth =
      colourError(readImage(frame("out", kFirstStep + 2)), readImage(frame("exact", kFirstStep + 2))).rmse;
  EXPECT_NEAR(std::get<double>(metadata.at("kairos:trueError")), truth, 1e-6);
  const std::string header = fileContents(frame("out", kFirstStep + 2)).substr(0, 2000);
  for (const char* channel : {"error", "age", "level"}) EXPECT_THAT(header, HasSubstr(channel));
}

TEST_F(Render, ASampleBudgetRepeatsBitForBit) {
  const Arguments options{"--budget", "samples:3000", "--range", "0,255", "--float"};
  ASSERT_TRUE(ok(render("once", join(options, {"--threads", "1"}))));
  ASSERT_TRUE(ok(render("again", join(options, {"--threads", "3"}))));
  expectSameFrames("once", "again");
}

TEST_F(Render, TheSummarySaysHowTheBudgetWasKept) {
  const ProgramResult result = render("out", {"--budget", "50ms", "--verify", "--range", "0,255"});
  ASSERT_TRUE(ok(result));
  EXPECT_THAT(result.out, HasSubstr("budget 50.00 ms"));
  EXPECT_THAT(result.out, HasSubstr("exact"));
  EXPECT_THAT(result.out, HasSubstr("verified"));
}

TEST_F(Render, AFrameOfWhichMostStandsStillIsMostlyReused) {
  ASSERT_TRUE(ok(render("out", {"--stats", dir / "s.jsonl", "--range", "0,255"})));
  const auto all = records(dir / "s.jsonl");
  ASSERT_EQ(all.size(), size_t(kSteps));
  for (size_t i = 1; i < all.size(); ++i) {
    EXPECT_GT(all[i]["samples"], 0);
    EXPECT_LT(all[i]["samples"].get<double>(), 0.6 * all[0]["samples"].get<double>()) << "frame " << i;
  }
}

TEST_F(Render, StatsOfAResumedRunAreAppended) {
  const Arguments options{"--stats", dir / "s.jsonl"};
  ASSERT_TRUE(ok(render("out", join(options, {"--frames", "3-5"}))));
  ASSERT_TRUE(ok(render("out", join(options, {"--resume"}))));
  std::vector<int> frames;
  for (const auto& record : records(dir / "s.jsonl")) frames.push_back(record["frame"]);
  EXPECT_THAT(frames, ElementsAre(3, 4, 5, 6, 7, 8));
}

TEST_F(Render, AHalfRecordOfAKilledRunIsRemovedFromTheStats) {
  const Arguments options{"--stats", dir / "s.jsonl"};
  ASSERT_TRUE(ok(render("out", join(options, {"--frames", "3-5"}))));
  std::ofstream(dir / "s.jsonl", std::ios::app) << R"({"frame":6,"meth)";
  ASSERT_TRUE(ok(render("out", join(options, {"--resume"}))));
  std::vector<int> frames;
  for (const auto& record : records(dir / "s.jsonl")) frames.push_back(record["frame"]);
  EXPECT_THAT(frames, ElementsAre(3, 4, 5, 6, 7, 8));
}

TEST_F(Render, ImagesSayWhereTheyComeFrom) {
  ASSERT_TRUE(ok(render("out", {"--frames", "4", "--tf", "magma"})));
  const Metadata metadata = readMetadata(frame("out", 4));
  for (const char* key :
       {"kairos:version", "kairos:step", "kairos:method", "kairos:samples", "kairos:settings"})
    EXPECT_TRUE(metadata.count(key)) << key;
  using namespace std::string_literals;
  const std::string header = fileContents(frame("out", 4));
  EXPECT_THAT(header, HasSubstr("comments\0string\0"s));
  EXPECT_THAT(header, HasSubstr("--tf magma"));
  EXPECT_EQ(std::get<int>(metadata.at("kairos:step")), 4);
}

TEST_F(Render, ALargeStepNumberIsStoredWhole) {
  writeRawFile(dir / "dated/s_20231127120000.raw", sceneAt<uint8_t>(0));
  ASSERT_TRUE(ok(run(join({"render", dir / "dated", "-o", dir / "out/f.##.exr", "--size", "8x8"}, raw))));
  const Metadata metadata = readMetadata(dir / "out/f.20231127120000.exr");
  EXPECT_EQ(std::get<double>(metadata.at("kairos:step")), 20231127120000.0);
}

TEST_F(Render, ChannelsAreStoredAsAsked) {
  using namespace std::string_literals;
  const Arguments one{"--frames", "4"};
  ASSERT_TRUE(ok(render("half", one)));
  ASSERT_TRUE(ok(render("float", join(one, {"--float", "--aov", "depth", "--compression", "piz", "--png"}))));
  const std::string half = fileContents(frame("half", 4)), full = fileContents(frame("float", 4));
  const std::string asHalf = "R\0\1\0\0\0"s, asFloat = "R\0\2\0\0\0"s, depth = "Z\0\2\0\0\0"s;
  EXPECT_THAT(half, HasSubstr(asHalf));
  EXPECT_THAT(half, Not(HasSubstr(depth)));
  EXPECT_THAT(full, HasSubstr(asFloat));
  EXPECT_THAT(full, HasSubstr(depth));
  const Image png = readImage(dir / "float/f.0004.png");
  EXPECT_EQ(png.width, 48);
  EXPECT_EQ(png.height, 40);
  EXPECT_TRUE(showsSomething(png));
  EXPECT_FALSE(fs::exists(dir / "half/f.0004.png"));
}

TEST_F(Render, EveryKindOfPictureShowsSomething) {
  std::ofstream(dir / "tf.txt") << "0 0 0 0 0\n255 1 0.5 0 0.4\n";
  const std::vector<Arguments> looks{{"--view", "-x"},
                                     {"--view", "z", "--ortho", "fit"},
                                     {"--view", "y", "--ortho", "30"},
                                     {"--eye", "20,20,20", "--target", "20,12,30", "--fov", "60"},
                                     {"--eye", "20,20,90"},
                                     {"--eye", "20,-50,20", "--up", "1,0,0", "--ortho", "50"},
                                     {"--mode", "mip"},
                                     {"--mode", "average", "--filter", "nearest"},
                                     {"--tf", "cividis", "--unit-distance", "0.5", "--terminate", "0.9"},
                                     {"--tf", dir / "tf.txt"},
                                     {"--tf", dir / "tf.txt", "--range", "auto", "--precision", "fast"},
                                     {"--clip-box", "0,0,0,40,20,20"}};
  for (size_t i = 0; i < looks.size(); ++i) {
    const std::string out = "look" + std::to_string(i);
    ASSERT_TRUE(ok(render(out, join({"--frames", "5"}, looks[i])))) << testing::PrintToString(looks[i]);
    EXPECT_TRUE(showsSomething(image(out, 5))) << testing::PrintToString(looks[i]);
  }
}

TEST_F(Render, QuietPrintsNothing) {
  const ProgramResult result = render("out", {"--quiet"});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.out + result.err, "");
}

TEST_F(Render, NoProgressIsDrawnWhereStderrIsNoTerminal) {
  const ProgramResult result = render("out", {});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("6 frames"));
}

TEST_F(Render, NaNAndInfiniteVoxelsAreCountedAndWarnedAboutOnce) {
  for (int i = 0; i < 3; ++i) {
    auto values = sceneAt<float>(i);
    values[size_t(17 * kEdge * kEdge + 12 * kEdge + 20)] = std::numeric_limits<float>::quiet_NaN();
    values[size_t(18 * kEdge * kEdge + 12 * kEdge + 20)] = std::numeric_limits<float>::infinity();
    writeRawFile(dir / ("nan/n_" + std::to_string(i) + ".raw"), values);
  }
  const ProgramResult result =
      renderInput(dir / "nan", "out", {"--dims", "40,40,40", "--type", "f32", "--stats", dir / "s.jsonl"});
  ASSERT_TRUE(ok(result));
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: " + (dir / "nan/n_0.raw")));
  EXPECT_THAT(result.err, HasSubstr("2 NaN or infinite voxels"));
  for (const auto& record : records(dir / "s.jsonl")) EXPECT_EQ(record["non_finite"], 2);
  for (const float v : image("out", 1).data) ASSERT_TRUE(std::isfinite(v));
}

TEST(Program, HelpAndVersionGoToStdout) {
  const ProgramResult version = runProgram({"--version"});
  EXPECT_EQ(version.exitCode, 0);
  EXPECT_THAT(version.out, testing::MatchesRegex("kairos [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  for (const Arguments& arguments : {Arguments{"--help"},
                                     {"diff", "--help"},
                                     {"info", "-h"},
                                     {"render", "--help"},
                                     {"compare", "--help"}}) {
    const ProgramResult help = runProgram(arguments);
    EXPECT_EQ(help.exitCode, 0) << arguments[0];
    EXPECT_EQ(help.err, "");
    EXPECT_THAT(help.out, HasSubstr("Example")) << arguments[0];
    EXPECT_THAT(help.out, HasSubstr("kairos " + (arguments.size() > 1 ? arguments[0] : "render")));
  }
}

TEST(Program, RenderHelpNamesEveryOptionInItsGroup) {
  const std::string help = runProgram({"render", "--help"}).out;
  size_t at = 0;
  for (const char* text : {"View:",
                           "--view",
                           "--eye",
                           "--target",
                           "--up",
                           "--fov",
                           "--ortho",
                           "--size",
                           "Transfer function:",
                           "--tf",
                           "--range",
                           "--unit-distance",
                           "Sampling:",
                           "--step",
                           "--filter",
                           "--mode",
                           "--shade",
                           "--terminate",
                           "--clip-box",
                           "--precision",
                           "Method:",
                           "--method",
                           "--projection",
                           "--order",
                           "--lom",
                           "--carry-over",
                           "--cut-off",
                           "--no-calibration",
                           "--threads",
                           "--isa",
                           "--cache-memory",
                           "Output:",
                           "-o",
                           "--frames",
                           "--half",
                           "--float",
                           "--compression",
                           "--png",
                           "--stats",
                           "--quiet",
                           "--aov",
                           "--resume",
                           "Examples:"}) {
    const size_t found = help.find(text, at);
    ASSERT_NE(found, std::string::npos) << text << " is missing or out of order";
    at = found;
  }
}

}  // namespace
}  // namespace kairos::test
