// The scene and the shorthands that the tests of `kairos render` share.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cli/run_program.h"
#include "io/image_file.h"

namespace kairos::test {

using Arguments = std::vector<std::string>;

constexpr int kEdge = 40, kFirstStep = 3, kSteps = 6;

// A plume that stands still, and a small ball that moves through it.
template <class T>
std::vector<T> sceneAt(int step) {
  std::vector<T> values;
  const double ball[3] = {10.0 + 2 * step, 28, 20};
  for (int z = 0; z < kEdge; ++z)
    for (int y = 0; y < kEdge; ++y)
      for (int x = 0; x < kEdge; ++x) {
        const double plume = 200 * std::exp(-((x - 20) * (x - 20) + (y - 12) * (y - 12)) / 40.0);
        const double d = std::hypot(x - ball[0], y - ball[1], z - ball[2]);
        values.push_back(T(std::max(plume, d < 4 ? 250 - 40 * d : 0)));
      }
  return values;
}

class Render : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const Arguments raw{"--dims", "40,40,40", "--type", "u8"};

  void SetUp() override {
    for (int i = 0; i < kSteps; ++i)
      writeRawFile(dir / ("sim/ball_000" + std::to_string(kFirstStep + i) + ".raw"), sceneAt<uint8_t>(i));
  }

  ProgramResult run(Arguments arguments, const RunOptions& options = {}) const {
    return runProgram(arguments, options);
  }

  // Renders the simulation's files to dir/out/.
  ProgramResult render(const std::string& out, const Arguments& options, const RunOptions& how = {}) const {
    return renderInput(dir / "sim", out, join(raw, options), how);
  }

  ProgramResult renderInput(const std::string& input, const std::string& out, const Arguments& options,
                            const RunOptions& how = {}) const {
    return run(join({"render", input, "-o", dir / (out + "/f.####.exr"), "--size", "48x40"}, options), how);
  }

  void makeSequence(const Arguments& options = {}) const {
    const ProgramResult result = run(join(join({"diff", dir / "sim", "-o", dir / "seq"}, raw), options));
    ASSERT_EQ(result.exitCode, 0) << result.err;
  }

  static Arguments join(Arguments a, const Arguments& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  std::string frame(const std::string& out, int step) const {
    return framePath(dir / (out + "/f.####.exr"), step);
  }
  Image image(const std::string& out, int step) const { return readImage(frame(out, step)); }

  void expectSameFrames(const std::string& a, const std::string& b) const {
    for (int step = kFirstStep; step < kFirstStep + kSteps; ++step)
      EXPECT_TRUE(image(a, step) == image(b, step)) << "step " << step << " of " << a << " and " << b;
  }

  std::vector<nlohmann::json> records(const std::string& path) const {
    std::istringstream lines(fileContents(path));
    std::vector<nlohmann::json> all;
    for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
};

inline bool ok(const ProgramResult& result) {
  EXPECT_EQ(result.exitCode, 0) << result.err;
  return result.exitCode == 0;
}

inline bool showsSomething(const Image& image) {
  return std::any_of(image.data.begin(), image.data.end(), [](float v) { return v > 0.05f; });
}

}  // namespace kairos::test
