// `kairos diff` stopped in the middle, one way or another, and started again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <random>
#include <thread>

#include "cli/simulations.h"
#include "io/sequence.h"

namespace kairos::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kSteps = 150;
constexpr Vec3i kLarge{40, 36, 30};

std::string numbered(const std::string& directory, int step) {
  std::string digits = std::to_string(step);
  return directory + "/diff." + std::string(4 - digits.size(), '0') + digits + ".vdb";
}

// Files of a sequence and what is in them. A killed run may leave a temporary file, never one of these names.
std::map<std::string, std::string> filesOf(const std::string& directory) {
  std::map<std::string, std::string> files;
  for (const std::string& name : fileNames(directory))
    if (name.find(".tmp-") == std::string::npos) files[name] = fileContents(directory + "/" + name);
  return files;
}

class DiffResume : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const std::string sequence = dir / "seq";

  void SetUp() override { writeWaves<float>(dir / "sim", 0, kSteps, kLarge); }

  std::string keyEvery = "20";

  ProgramResult diff(const std::string& output, const RunOptions& how = {}) const {
    return runProgram(
        Arguments{"diff", dir / "sim", "-o", output, "--key-every", keyEvery, "--tolerance", "0.5"} +
            rawArguments(ElementType::f32, kLarge),
        how);
  }

  // Runs until the file of `step` is there, then sends the signal.
  ProgramResult diffUntil(int step, int signal) const {
    return diff(sequence,
                {std::nullopt, [&](pid_t child) {
                   const auto giveUp = std::chrono::steady_clock::now() + std::chrono::seconds(60);
                   while (!fs::exists(numbered(sequence, step)) && std::chrono::steady_clock::now() < giveUp)
                     std::this_thread::sleep_for(std::chrono::microseconds(100));
                   ::kill(child, signal);
                 }});
  }

  void expectSameAsUninterrupted() const {
    ASSERT_EQ(diff(dir / "whole").exitCode, 0);
    const auto whole = filesOf(dir / "whole"), resumed = filesOf(sequence);
    ASSERT_EQ(whole.size(), resumed.size());
    for (const auto& [name, contents] : whole) EXPECT_TRUE(resumed.at(name) == contents) << name;
  }
};

TEST_F(DiffResume, GoesOnAfterCtrlC) {
  const ProgramResult stopped = diffUntil(5, SIGINT);
  ASSERT_EQ(stopped.exitCode, 130) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("the same command goes on"));
  const SequenceManifest half = readManifest(sequence);
  EXPECT_FALSE(half.complete);
  EXPECT_GE(half.steps.size(), 5u);
  EXPECT_LT(half.steps.size(), size_t(kSteps));

  const ProgramResult resumed = diff(sequence);
  EXPECT_EQ(resumed.exitCode, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("going on after step " + std::to_string(half.steps.back().step)));
  expectSameAsUninterrupted();
}

TEST_F(DiffResume, GoesOnAfterBeingKilledAtAnyPoint) {
  std::mt19937 random(5);
  int step = 1;
  for (int kill = 0; kill < 5; ++kill) {
    step += std::uniform_int_distribution(1, 12)(random);
    ASSERT_EQ(diffUntil(step, SIGKILL).exitCode, 128 + SIGKILL);
    if (fs::exists(sequence + "/sequence.json")) {
      EXPECT_FALSE(readManifest(sequence).complete);
    }
  }
  ASSERT_EQ(diff(sequence).exitCode, 0);
  expectSameAsUninterrupted();
}

TEST_F(DiffResume, GoesOnAfterTheDiskWasFull) {
  const ProgramResult full = diff(sequence, {uint64_t(24 * 1024), {}});
  EXPECT_EQ(full.exitCode, 1);
  EXPECT_TRUE(full.err.find(sequence) != std::string::npos) << full.err;
  EXPECT_THAT(full.err, HasSubstr("File too large"));
  for (const std::string& name : fileNames(sequence))
    EXPECT_EQ(name.find(".tmp-"), std::string::npos) << name;
  EXPECT_EQ(diff(sequence).exitCode, 0);
  expectSameAsUninterrupted();
}

TEST_F(DiffResume, RebuildsFromTheLastIntactFile) {
  ASSERT_EQ(diffUntil(30, SIGINT).exitCode, 130);
  fs::resize_file(numbered(sequence, 25), 100);
  ASSERT_EQ(diff(sequence).exitCode, 0);
  expectSameAsUninterrupted();
}

TEST_F(DiffResume, RefusesToGoOnFromADamagedFile) {
  keyEvery = "0";
  ASSERT_EQ(diffUntil(10, SIGINT).exitCode, 130);
  std::string bytes = fileContents(numbered(sequence, 6));
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(numbered(sequence, 6), std::ios::binary) << bytes;
  const ProgramResult result = diff(sequence);
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_THAT(result.err, HasSubstr("diff.0006.vdb"));
  EXPECT_THAT(result.err, HasSubstr("--overwrite starts anew"));
}

TEST_F(DiffResume, KeepsWhatWasDoneBeforeAnUnreadableStep) {
  const std::string broken = dir / ("sim/" + rawName(100));
  const std::string contents = fileContents(broken);
  // Of the right size when the series is opened, gone when it is read: a simulation that cleans up behind
  // itself.
  const ProgramResult failed =
      diff(sequence, {std::nullopt, [&](pid_t) {
                        while (!fs::exists(numbered(sequence, 1)))
                          std::this_thread::sleep_for(std::chrono::microseconds(100));
                        fs::remove(broken);
                      }});
  ASSERT_EQ(failed.exitCode, 1) << failed.err;
  EXPECT_THAT(failed.err, HasSubstr(rawName(100)));
  EXPECT_EQ(readManifest(sequence).steps.size(), 100u) << "all steps before it are kept";
  std::ofstream(broken, std::ios::binary) << contents;
  ASSERT_EQ(diff(sequence).exitCode, 0);
  expectSameAsUninterrupted();
}

}  // namespace
}  // namespace kairos::test
