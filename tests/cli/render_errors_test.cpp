// What `kairos render` says to wrong usage and bad input.
#include "cli/render_fixture.h"

namespace kairos::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class RenderErrors : public Render {
 protected:
  // Expects one line that holds every one of `parts`, the exit code, and no image.
  void expectFailure(const ProgramResult& result, int exitCode, const std::vector<std::string>& parts) const {
    EXPECT_EQ(result.exitCode, exitCode) << result.err;
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_EQ(result.out, "");
    for (const std::string& part : parts) EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_THAT(fileNames(dir / "out"), IsEmpty());
  }
};

TEST_F(RenderErrors, AbsurdOptionValuesAreRefusedByName) {
  const std::vector<Arguments> wrong{{"--size", "0x0"},
                                     {"--size", "0x10"},
                                     {"--size", "512"},
                                     {"--size", "-5x5"},
                                     {"--size", "1e9x1e9"},
                                     {"--size", "99999999999x2"},
                                     {"--step", "0"},
                                     {"--step", "-1"},
                                     {"--step", "nan"},
                                     {"--step", "1e30"},
                                     {"--step", "x"},
                                     {"--fov", "0"},
                                     {"--fov", "180"},
                                     {"--fov", "inf"},
                                     {"--ortho", "0"},
                                     {"--ortho", "-3"},
                                     {"--view", "up"},
                                     {"--eye", "1,2"},
                                     {"--eye", "1,2,nan"},
                                     {"--eye", "1,2,3,4"},
                                     {"--range", "5,5"},
                                     {"--range", "9,1"},
                                     {"--range", "0,inf"},
                                     {"--range", "low"},
                                     {"--unit-distance", "0"},
                                     {"--unit-distance", "-1"},
                                     {"--terminate", "-0.1"},
                                     {"--terminate", "1.5"},
                                     {"--clip-box", "0,0,0,0,1,1"},
                                     {"--clip-box", "1,2,3"},
                                     {"--filter", "cubic"},
                                     {"--mode", "iso"},
                                     {"--method", "best"},
                                     {"--budget", "40"},
                                     {"--budget", "0ms"},
                                     {"--budget", "samples:1"},
                                     {"--budget", "xfps"},
                                     {"--budget", "error:0"},
                                     {"--budget", "error:x"},
                                     {"--seed", "-1"},
                                     {"--precision", "half"},
                                     {"--threads", "0"},
                                     {"--threads", "-2"},
                                     {"--threads", "100000"},
                                     {"--threads", "2.5"},
                                     {"--isa", "neon"},
                                     {"--cache-memory", "-1GiB"},
                                     {"--cache-memory", "2GB"},
                                     {"--cache-memory", "1e30"},
                                     {"--frames", "9-3"},
                                     {"--frames", "a"},
                                     {"--frames", "-"},
                                     {"--frames", "100-200"},
                                     {"--compression", "dwaa"},
                                     {"--aov", "normal"},
                                     {"--tolerance", "-1"},
                                     {"--tolerance", "nan"},
                                     {"--tf", "no-such-map"},
                                     {"--dims", "0,1,1"},
                                     {"--voxel-size", "0"}};
  for (const Arguments& option : wrong) {
    SCOPED_TRACE(testing::PrintToString(option));
    // A second --size or --dims would be an error of its own.
    Arguments arguments{"render", dir / "sim", "-o", dir / "out/f.####.exr", "--type", "u8"};
    if (option[0] != "--dims") arguments = join(arguments, {"--dims", "40,40,40"});
    expectFailure(run(join(arguments, option)), 2, {option[0], option[1], "expected"});
    if (HasFailure()) return;
  }
}

TEST_F(RenderErrors, WhatExistsIsListedWhereSomethingElseIsAskedFor) {
  expectFailure(render("out", {"--method", "any"}), 2, {"--method", "full", "segments", "anytime"});
  expectFailure(render("out", {"--aov", "albedo"}), 2, {"--aov", "age", "depth"});
  expectFailure(render("out", {"--tf", "rainbow"}), 2, {"--tf", "viridis", "inferno"});
}

TEST_F(RenderErrors, ContradictionsAreNamed) {
  expectFailure(render("out", {"--view", "x", "--eye", "1,2,3"}), 2, {"--view", "--eye"});
  expectFailure(render("out", {"--target", "1,2,3"}), 2, {"--target", "--eye"});
  expectFailure(render("out", {"--up", "1,2,3"}), 2, {"--up", "--eye"});
  expectFailure(render("out", {"--fov", "40", "--ortho", "fit"}), 2, {"--fov", "--ortho"});
  expectFailure(render("out", {"--ortho", "fit", "--eye", "1,2,3"}), 2, {"--ortho"});
  expectFailure(render("out", {"--half", "--float"}), 2, {"--half", "--float"});
  expectFailure(render("out", {"--budget", "40ms", "--method", "segments"}), 2, {"--budget", "segments"});
  expectFailure(render("out", {"--budget", "error:1e-3", "--method", "tcdvrm"}), 2, {"--budget", "anytime"});
  expectFailure(render("out", {"--budget", "40ms", "--mode", "mip"}), 2, {"--budget", "dvr"});
  expectFailure(render("out", {"--budget", "40ms", "--aov", "depth"}), 2, {"--aov", "depth"});
  expectFailure(render("out", {"--shade", "--mode", "mip"}), 2, {"--shade", "dvr"});
  expectFailure(render("out", {"--aov", "depth", "--mode", "mip"}), 2, {"--aov", "dvr"});
  expectFailure(render("out", {"--eye", "1,2,3", "--target", "1,2,3"}), 2, {"--eye"});
  expectFailure(render("out", {"--eye", "20,20,90", "--target", "20,20,0", "--up", "0,0,1"}), 2, {"--up"});
  makeSequence();
  expectFailure(renderInput(dir / "seq", "out", {"--tolerance", "1"}), 2, {"--tolerance", "seq"});
  expectFailure(renderInput(dir / "seq", "out", raw), 2, {"seq"});
}

TEST_F(RenderErrors, UnknownAndIncompleteOptionsAreNamed) {
  expectFailure(render("out", {"--no-such-option"}), 2,
                {"unknown option --no-such-option", "kairos render --help"});
  for (const char* later : {"--antialias", "--gpu"})
    expectFailure(render("out", {later, "1"}), 2, {std::string("unknown option ") + later});
  expectFailure(render("out", {"--step"}), 2, {"--step", "expected a value"});
  expectFailure(render("out", {"--step", "1", "--step", "2"}), 2, {"--step", "more than once"});
  expectFailure(run({"render", dir / "sim"}), 2, {"-o", "required"});
  expectFailure(run({"render", "-o", dir / "out/f.####.exr"}), 2, {"INPUT", "required"});
  expectFailure(run({"rendr"}), 2, {"rendr", "diff", "render"});
  expectFailure(run({}), 2, {"no command", "kairos --help"});
  expectFailure(run({"--bogus"}), 2, {"kairos --help"});
}

TEST_F(RenderErrors, MissingAndWrongInputIsNamed) {
  expectFailure(renderInput(dir / "nowhere", "out", {}), 1, {"nowhere"});
  expectFailure(renderInput(dir / "sim", "out", {}), 2, {"--dims"});
  fs::resize_file(dir / "sim/ball_0005.raw", 1000);
  expectFailure(render("out", {}), 1, {"ball_0005.raw"});
}

TEST_F(RenderErrors, ADamagedSequenceKeepsTheFramesBefore) {
  makeSequence();
  ASSERT_TRUE(ok(renderInput(dir / "seq", "reference", {})));
  fs::resize_file(dir / "seq/diff.0006.vdb", fs::file_size(dir / "seq/diff.0006.vdb") / 2);
  const ProgramResult result = renderInput(dir / "seq", "out", {});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("diff.0006.vdb"));
  EXPECT_THAT(fileNames(dir / "out"), ElementsAre("f.0003.exr", "f.0004.exr", "f.0005.exr"));
  for (int step : {3, 4, 5}) EXPECT_TRUE(image("out", step) == image("reference", step));
}

TEST_F(RenderErrors, ADifferentialFileOfAnotherStateIsNotRendered) {
  makeSequence();
  fs::copy_file(dir / "seq/diff.0007.vdb", dir / "seq/diff.0005.vdb", fs::copy_options::overwrite_existing);
  const ProgramResult result = renderInput(dir / "seq", "out", {});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("diff.0005.vdb"));
  EXPECT_THAT(fileNames(dir / "out"), ElementsAre("f.0003.exr", "f.0004.exr"));
}

TEST_F(RenderErrors, OutputThatCannotBeWrittenIsRefusedBeforeAnythingIsLoaded) {
  std::ofstream(dir / "file") << "x";
  const auto to = [&](const std::string& pattern) {
    return run(join({"render", dir / "nowhere", "-o", pattern}, raw));
  };
  expectFailure(to(dir / "file/f.####.exr"), 1, {"file"});
  expectFailure(to("/proc/kairos/f.####.exr"), 1, {"/proc/kairos"});
  expectFailure(to(dir / "out/f.####.jpg"), 2, {".exr"});
  expectFailure(to(dir / "out/f.exr"), 2, {"####"});
  expectFailure(run(join({"render", dir / "nowhere", "-o", dir / "out/f.exr", "--frames", "3-4"}, raw)), 2,
                {"####"});
  expectFailure(render("out", {"--stats", dir / "file/s.jsonl"}), 1, {"file/s.jsonl"});
}

TEST_F(RenderErrors, AFullDiskLeavesNoPartialFile) {
  RunOptions full;
  full.fileSizeLimit = 2048;
  expectFailure(render("out", {"--compression", "none"}, full), 1, {"out/f.000"});
}

TEST_F(RenderErrors, AViewThatMissesTheVolumeIsAnErrorAndNotABlackAnimation) {
  expectFailure(render("out", {"--eye", "100,100,100", "--target", "200,200,200"}), 2,
                {"--eye", "--clip-box"});
  expectFailure(render("out", {"--clip-box", "500,500,500,501,501,501"}), 2, {"--clip-box"});
}

}  // namespace
}  // namespace kairos::test
