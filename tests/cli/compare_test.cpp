// `kairos compare`: figures, matching of frames, exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/run_program.h"
#include "core/image_difference.h"
#include "io/image_file.h"

namespace kairos::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Image picture(int width, int height, float brighter = 0) {
  Image image(width, height, 4);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 4; ++c)
        image.pixel(x, y)[c] = 0.25f + 0.25f * float(c) * float(x % 7) / 18 + brighter;
  return image;
}

class Compare : public testing::Test {
 protected:
  const ScratchDirectory dir;

  std::string save(const std::string& name, const Image& image) const {
    const std::string path = dir / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    ExrOptions options;
    options.half = false;
    writeExr(path, image, {}, Camera{}, {}, options);
    return path;
  }
  std::string saveFrame(const std::string& side, int step, float brighter = 0) const {
    return save(framePath(side + "/f.####.exr", step), picture(40, 32, brighter));
  }

  ProgramResult compare(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words{"compare"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return runProgram(words);
  }
  json compareJson(std::vector<std::string> arguments, int code = 0) const {
    arguments.push_back("--json");
    const ProgramResult result = compare(arguments);
    EXPECT_EQ(result.exitCode, code) << result.err;
    return json::parse(result.out);
  }
};

TEST_F(Compare, FindsNoDifferenceBetweenEqualImages) {
  const std::string a = save("a.exr", picture(40, 32)), b = save("b.exr", picture(40, 32));
  const json result = compareJson({a, b, "--fail-rmse", "0"});
  EXPECT_EQ(result["passed"], true);
  EXPECT_EQ(result["frames"][0]["equal"], true);
  EXPECT_EQ(result["frames"][0]["rmse"], 0);
  EXPECT_EQ(result["frames"][0]["psnr"], nullptr) << "JSON has no infinity";
  EXPECT_EQ(result["frames"][0]["ssim"], 1);
  EXPECT_EQ(result["frames"][0]["flip"], 0);
  EXPECT_THAT(compare({a, b}).out, HasSubstr("1 frame, all equal"));
}

TEST_F(Compare, ReportsTheFiguresOfTheLibrary) {
  const Image a = picture(40, 32), b = picture(40, 32, 0.125f);
  const json frame = compareJson({save("a.exr", a), save("b.exr", b)})["frames"][0];
  const ImageDifference expected = compareImages(a, b);
  EXPECT_NEAR(frame["rmse"], 0.125, 1e-6);
  EXPECT_NEAR(frame["max"], 0.125, 1e-6);
  EXPECT_NEAR(frame["psnr"], -20 * std::log10(0.125), 1e-4);
  EXPECT_NEAR(frame["ssim"], expected.ssim, 1e-9);
  EXPECT_NEAR(frame["flip"], expected.flip, 1e-9);
  EXPECT_GT(frame["flip"], 0.0);
}

TEST_F(Compare, FailsOnlyAboveTheLimit) {
  const std::string a = save("a.exr", picture(16, 16)), b = save("b.exr", picture(16, 16, 0.125f));
  EXPECT_EQ(compare({a, b}).exitCode, 0);
  EXPECT_EQ(compare({a, b, "--fail-rmse", "0.126"}).exitCode, 0);
  const ProgramResult failed = compare({a, b, "--fail-rmse", "0.124"});
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_THAT(failed.out, HasSubstr("exceeds --fail-rmse 0.124"));
  EXPECT_EQ(compareJson({a, b, "--fail-rmse", "0"}, 1)["passed"], false);
}

TEST_F(Compare, FailsWhenOneFrameOfManyDoes) {
  for (int step = 8; step < 12; ++step) {
    saveFrame("a", step);
    saveFrame("b", step, step == 10 ? 0.25f : 0);
  }
  const std::vector<std::string> sides{dir / "a/f.####.exr", dir / "b/f.%04d.exr"};
  const json result = compareJson({sides[0], sides[1], "--fail-rmse", "0.1"}, 1);
  ASSERT_EQ(result["frames"].size(), 4u);
  EXPECT_EQ(result["summary"]["worst_step"], 10);
  EXPECT_EQ(result["summary"]["frames_different"], 1);
  EXPECT_NEAR(result["summary"]["rmse"], 0.0625, 1e-6);
  EXPECT_NEAR(result["summary"]["psnr"], -10 * std::log10(0.0625 / 4), 1e-4) << "of the mean squared error";
  EXPECT_THAT(compare(sides).out, AllOf(HasSubstr("1 frame of 4 differs"), HasSubstr("f.0010.exr")));
}

TEST_F(Compare, MatchesFramesByTheirNumberNotTheirOrder) {
  for (const int step : {1, 2, 10}) {
    saveFrame("a", step, float(step) / 64);
    save("b/g" + std::to_string(step) + ".exr", picture(40, 32, float(step) / 64));
  }
  const json result = compareJson({dir / "a/f.####.exr", dir / "b/g*.exr"});
  ASSERT_EQ(result["frames"].size(), 3u);
  for (const json& frame : result["frames"]) EXPECT_EQ(frame["equal"], true) << frame;
}

TEST_F(Compare, NamesFramesThatStandOnOneSideOnly) {
  for (const int step : {1, 2, 3, 4}) saveFrame("a", step);
  for (const int step : {1, 4, 7}) saveFrame("b", step);
  const ProgramResult result = compare({dir / "a/f.####.exr", dir / "b/f.####.exr"});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("2, 3"), HasSubstr(dir / "b/f.####.exr")));
}

TEST_F(Compare, RefusesImagesOfDifferentSize) {
  const std::string a = save("a.exr", picture(40, 32)), b = save("b.exr", picture(32, 40));
  const ProgramResult result = compare({a, b});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_THAT(result.err, AllOf(HasSubstr(a), HasSubstr(b), HasSubstr("32 x 40"), HasSubstr("40 x 32")));
}

TEST_F(Compare, CountsNanAsADifferenceThatNoLimitAllows) {
  Image broken = picture(16, 16);
  broken.pixel(3, 4)[1] = std::numeric_limits<float>::quiet_NaN();
  const std::string a = save("a.exr", picture(16, 16)), b = save("b.exr", broken);
  const json result = compareJson({a, b, "--fail-rmse", "1e30"}, 1);
  EXPECT_EQ(result["frames"][0]["rmse"], nullptr);
  EXPECT_EQ(result["frames"][0]["equal"], false);
}

TEST_F(Compare, ReadsPngToo) {
  const std::string exr = save("a.exr", picture(16, 16)), png = dir / "a.png";
  writePng(png, picture(16, 16));
  EXPECT_EQ(compare({png, png, "--fail-rmse", "0"}).exitCode, 0);
  EXPECT_EQ(compare({exr, png}).exitCode, 0);
}

TEST_F(Compare, NamesWhatCannotBeRead) {
  const std::string a = save("a.exr", picture(16, 16)), text = dir / "text.exr";
  std::ofstream(text) << "no picture";
  for (const std::string& bad : {text, dir / "missing.exr", dir / "none.####.exr", dir.path()}) {
    for (const auto& sides : {std::vector{a, bad}, std::vector{bad, a}}) {
      const ProgramResult result = compare(sides);
      EXPECT_EQ(result.exitCode, 1);
      EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
      EXPECT_THAT(result.err, HasSubstr(bad));
    }
  }
}

TEST_F(Compare, RefusesAbsurdLimits) {
  const std::string a = save("a.exr", picture(16, 16));
  for (const char* limit : {"-1", "nan", "inf", "small"}) {
    const ProgramResult result = compare({a, a, "--fail-rmse", limit});
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_THAT(result.err, AllOf(HasSubstr("--fail-rmse"), HasSubstr(limit)));
  }
  EXPECT_EQ(compare({a}).exitCode, 2) << "two sides are needed";
}

}  // namespace
}  // namespace kairos::test
