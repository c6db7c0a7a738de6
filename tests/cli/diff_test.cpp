// `kairos diff` from simulation files to a sequence: what comes out is what went in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <cmath>
#include <cstring>

#include "cli/simulations.h"
#include "io/sequence.h"
#include "volume/changed_voxels.h"

namespace kairos::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

template <class T>
class DiffOfType : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const std::string sequence = dir / "seq";

  ProgramResult diff(int steps, const Arguments& options) {
    writeWaves<T>(dir / "sim", 3, steps);
    return runProgram(Arguments{"diff", dir / "sim", "-o", sequence} + rawArguments(elementTypeOf<T>()) +
                      options);
  }
};
using ElementTypes = testing::Types<uint8_t, uint16_t, float>;
TYPED_TEST_SUITE(DiffOfType, ElementTypes);

TYPED_TEST(DiffOfType, RebuildsEveryStepBitForBit) {
  const ProgramResult result = this->diff(8, {"--key-every", "3"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const SequenceReader reader(this->sequence);
  ASSERT_EQ(reader.stepCount(), 8u);
  EXPECT_TRUE(reader.manifest().complete);
  uint64_t changed = 0;
  for (size_t i = 0; i < 8; ++i) {
    const auto values = waveAt<TypeParam>(3 + int(i));
    const Field expected = fieldFromDense(values.data(), kDims);
    const Field found = reader.readStep(i);
    EXPECT_EQ(found.leafOrigins, expected.leafOrigins);
    const auto &a = valuesAs<TypeParam>(found.values), &b = valuesAs<TypeParam>(expected.values);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(TypeParam)), 0) << "step " << 3 + i;
    const SequenceStep& entry = reader.manifest().steps[i];
    EXPECT_EQ(entry.step, 3 + int64_t(i));
    EXPECT_EQ(entry.key, i % 3 == 0);
    EXPECT_EQ(entry.stateChecksum, stateChecksum(expected));
    const FieldStatistics statistics = fieldStatistics(expected);
    EXPECT_EQ(entry.range, (ValueRange{float(statistics.lo), float(statistics.hi)}));
    EXPECT_EQ(entry.nonFinite, statistics.nonFinite);
    changed += entry.changedVoxels;
  }
  EXPECT_GT(changed, 0u);
  EXPECT_LT(changed, uint64_t(7 * kDims.x * kDims.y * kDims.z)) << "part of the volume stands still";
}

TYPED_TEST(DiffOfType, ToleranceBoundsTheErrorAtEveryStepOfALongChain) {
  constexpr double kTolerance = 4.5;
  const ProgramResult result = this->diff(60, {"--tolerance", "4.5"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const SequenceReader reader(this->sequence);
  Field field = reader.readKey(0);
  double worst = 0;
  for (size_t i = 1; i < reader.stepCount(); ++i) {
    applyChanges(reader.readChanges(i), field);
    const auto values = waveAt<TypeParam>(3 + int(i));
    size_t n = 0;
    for (int z = 0; z < kDims.z; ++z)
      for (int y = 0; y < kDims.y; ++y)
        for (int x = 0; x < kDims.x; ++x, ++n) {
          const double found = field.value({x, y, z}), expected = double(values[n]);
          if (!std::isfinite(expected))
            EXPECT_TRUE(std::isnan(expected) ? std::isnan(found) : found == expected);
          else
            worst = std::max(worst, std::abs(found - expected));
        }
  }
  EXPECT_LE(worst, kTolerance);
  EXPECT_GT(worst, 1) << "the tolerance should have left something out";
}

TEST(Diff, SummarisesWhatItDid) {
  const ScratchDirectory dir;
  writeWaves<float>(dir / "sim", 0, 5);
  const ProgramResult result =
      runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq"} + rawArguments(ElementType::f32));
  ASSERT_EQ(result.exitCode, 0) << result.err;
  for (const char* part :
       {"5 steps, 0 to 4", "changed voxels", "median", "max", "bytes per changed voxel (the paper: 4)",
        "of input", "in 5 steps, at most 3 a step", "B/s"})
    EXPECT_THAT(result.out, HasSubstr(part));
}

TEST(Diff, WarnsOnceOfNonFiniteVoxels) {
  const ScratchDirectory dir;
  writeWaves<float>(dir / "sim", 0, 5);
  const ProgramResult result =
      runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq"} + rawArguments(ElementType::f32));
  EXPECT_THAT(result.err, HasSubstr("wave_0000.raw: 2 voxels are NaN or infinite"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST(Diff, SaysNothingWhenQuiet) {
  const ScratchDirectory dir;
  writeWaves<uint8_t>(dir / "sim", 0, 3);
  const ProgramResult result = runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq", "--quiet"} +
                                          rawArguments(ElementType::u8));
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.out + result.err, "");
}

TEST(Diff, ReadsAnOpenVdbSeriesByPattern) {
  const ScratchDirectory dir;
  writeWaves<float>(dir / "sim", 10, 4);
  ASSERT_EQ(runProgram(Arguments{"diff", dir / "sim", "-o", dir / "a", "--key-every", "1"} +
                       rawArguments(ElementType::f32))
                .exitCode,
            0);
  const ProgramResult result = runProgram({"diff", dir / "a/key.####.vdb", "-o", dir / "b"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const SequenceReader a(dir / "a"), b(dir / "b");
  ASSERT_EQ(b.stepCount(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(b.manifest().steps[i].step, a.manifest().steps[i].step);
    EXPECT_EQ(stateChecksum(b.readStep(i)), stateChecksum(a.readStep(i)));
  }
}

TEST(Diff, GivesTheSameFilesWhateverTheThreads) {
  const ScratchDirectory dir;
  writeWaves<uint16_t>(dir / "sim", 0, 7);
  for (const char* threads : {"1", "2", "5"})
    ASSERT_EQ(runProgram(Arguments{"diff", dir / "sim", "-o", dir / threads, "--threads", threads} +
                         rawArguments(ElementType::u16))
                  .exitCode,
              0);
  for (const std::string& name : fileNames(dir / "1"))
    for (const char* threads : {"2", "5"})
      EXPECT_EQ(fileContents(dir / ("1/" + name)), fileContents(dir / (std::string(threads) + "/" + name)))
          << name;
}

TEST(Diff, MakesASequenceOfASingleStep) {
  const ScratchDirectory dir;
  writeWaves<uint8_t>(dir / "sim", 7, 1);
  const ProgramResult result =
      runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq"} + rawArguments(ElementType::u8));
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(fileNames(dir / "seq"), ElementsAre("key.0007.vdb", "sequence.json"));
}

TEST(Diff, KeepsTheVoxelSize) {
  const ScratchDirectory dir;
  writeWaves<uint8_t>(dir / "sim", 0, 2);
  ASSERT_EQ(runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq", "--voxel-size", "0.5,1,2"} +
                       rawArguments(ElementType::u8))
                .exitCode,
            0);
  EXPECT_EQ(readManifest(dir / "seq").lattice.worldFromIndex, Affine::scale({0.5, 1, 2}));
}

class DiffTwice : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const std::string sequence = dir / "seq";

  void SetUp() override {
    writeWaves<uint8_t>(dir / "sim", 0, 6);
    ASSERT_EQ(diff().exitCode, 0);
  }
  ProgramResult diff(const Arguments& options = {}, const std::string& input = "sim") const {
    return runProgram(Arguments{"diff", dir / input, "-o", sequence} + rawArguments(ElementType::u8) +
                      options);
  }
};

TEST_F(DiffTwice, SaysThatTheSequenceIsComplete) {
  const std::string before = fileContents(sequence + "/sequence.json");
  const ProgramResult again = diff();
  EXPECT_EQ(again.exitCode, 0);
  EXPECT_THAT(again.out, HasSubstr("already complete"));
  EXPECT_THAT(again.err, IsEmpty());
  EXPECT_EQ(fileContents(sequence + "/sequence.json"), before);
}

TEST_F(DiffTwice, HintsAtInputThatIsNewerThanTheSequence) {
  const std::string input = dir / "sim/wave_0002.raw";
  std::filesystem::last_write_time(input,
                                   std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  const ProgramResult again = diff();
  EXPECT_EQ(again.exitCode, 0);
  EXPECT_THAT(again.err, HasSubstr("wave_0002.raw is newer than the sequence"));
}

TEST_F(DiffTwice, RefusesOtherSettingsAndSaysWhichDiffer) {
  const std::string before = fileContents(sequence + "/sequence.json");
  for (const auto& [options, word] : {std::pair{Arguments{"--tolerance", "2"}, "tolerance"},
                                      std::pair{Arguments{"--key-every", "2"}, "key_every"},
                                      std::pair{Arguments{"--voxel-size", "2"}, "transform"}}) {
    const ProgramResult result = diff(options);
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_THAT(result.err, HasSubstr(word));
    EXPECT_THAT(result.err, HasSubstr("--overwrite"));
  }
  writeWaves<uint8_t>(dir / "longer", 0, 8);
  EXPECT_THAT(diff({}, "longer").err, HasSubstr("number of inputs"));
  EXPECT_EQ(fileContents(sequence + "/sequence.json"), before);
}

TEST_F(DiffTwice, ReplacesTheSequenceWhenAskedTo) {
  writeWaves<uint8_t>(dir / "other", 40, 2);
  ASSERT_EQ(diff({"--overwrite"}, "other").exitCode, 0);
  EXPECT_THAT(fileNames(sequence), ElementsAre("diff.0041.vdb", "key.0040.vdb", "sequence.json"));
}

TEST_F(DiffTwice, RefusesACompleteSequenceThatLacksAFile) {
  std::filesystem::remove(sequence + "/diff.0003.vdb");
  const ProgramResult result = diff();
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_THAT(result.err, HasSubstr("missing"));
  EXPECT_EQ(diff({"--overwrite"}).exitCode, 0);
  EXPECT_THAT(fileNames(sequence), Contains("diff.0003.vdb"));
}

TEST_F(DiffTwice, RefusesASequenceAsInput) {
  const ProgramResult result = runProgram({"diff", sequence, "-o", dir / "again"});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_THAT(result.err, HasSubstr("is a sequence already"));
}

long largestMemoryOfChildren() {  // kB, over all that have ended
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_maxrss;
}

TEST(Diff, TakesNoMoreMemoryForALongSeries) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer keeps freed memory for a while";
#endif
  constexpr Vec3i kLarge{64, 64, 48};
  constexpr long kFieldKilobytes = 64 * 64 * 48 * 4 / 1024;
  const ScratchDirectory dir;
  writeWaves<float>(dir / "short", 0, 12, kLarge);
  writeWaves<float>(dir / "long", 0, 90, kLarge);
  for (const char* series : {"short", "long"}) {
    const long before = largestMemoryOfChildren();
    ASSERT_EQ(runProgram(Arguments{"diff", dir / series, "-o", dir / (std::string(series) + ".seq"),
                                   "--threads", "2"} +
                         rawArguments(ElementType::f32, kLarge))
                  .exitCode,
              0);
    if (series == std::string("long")) {
      EXPECT_LT(largestMemoryOfChildren() - before, 16 * kFieldKilobytes);
    }
  }
}

}  // namespace
}  // namespace kairos::test
