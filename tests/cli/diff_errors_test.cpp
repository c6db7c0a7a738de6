// What `kairos diff` says to input, output and options that cannot be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/simulations.h"
#include "io/vdb_files.h"

namespace kairos::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class DiffErrors : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const Arguments raw = rawArguments(ElementType::u8);

  void SetUp() override { writeWaves<uint8_t>(dir / "sim", 0, 4); }

  // Expects exit code `code` and one line on stderr, which is returned, and no sequence.
  std::string failure(int code, const Arguments& arguments, const std::string& output = "") const {
    const std::string sequence = output.empty() ? dir / "seq" : output;
    const ProgramResult result = runProgram(Arguments{"diff", "-o", sequence} + arguments);
    EXPECT_EQ(result.exitCode, code) << result.err;
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_FALSE(fs::exists(fs::path(sequence) / "sequence.json"));
    return result.err;
  }
};

TEST_F(DiffErrors, NamesMissingInput) {
  EXPECT_THAT(failure(1, Arguments{dir / "nothing.raw"} + raw), HasSubstr(dir / "nothing.raw"));
  EXPECT_THAT(failure(1, Arguments{dir / "sim/none_####.raw"} + raw), HasSubstr("none_####.raw"));
  fs::create_directory(dir / "empty");
  EXPECT_THAT(failure(1, Arguments{dir / "empty"} + raw), HasSubstr(dir / "empty"));
}

TEST_F(DiffErrors, NamesTheFileOfTheWrongSize) {
  fs::resize_file(dir / "sim/wave_0002.raw", 1000);
  EXPECT_THAT(failure(1, Arguments{dir / "sim"} + raw),
              AllOf(HasSubstr("wave_0002.raw"), HasSubstr("1000"), HasSubstr("4080")));
}

TEST_F(DiffErrors, RefusesDimensionsThatDoNotFitTheFiles) {
  EXPECT_THAT(failure(1, {dir / "sim", "--dims", "20,17,13", "--type", "u8"}),
              AllOf(HasSubstr("wave_0000.raw"), HasSubstr("4080")));
  EXPECT_THAT(failure(1, {dir / "sim", "--dims", "20,17,12", "--type", "f32"}), HasSubstr("wave_0000.raw"));
}

TEST_F(DiffErrors, AsksForTheDimensionsOfRawFiles) {
  EXPECT_THAT(failure(2, {dir / "sim"}), HasSubstr("--dims"));
}

TEST_F(DiffErrors, RefusesWhatIsNoOpenVdbFile) {
  std::ofstream(dir / "text.vdb") << "this is no volume, whatever its name says";
  EXPECT_THAT(failure(1, {dir / "text.vdb"}), AllOf(HasSubstr(dir / "text.vdb"), HasSubstr("OpenVDB")));
  std::ofstream(dir / "nothing.vdb").flush();
  EXPECT_THAT(failure(1, {dir / "nothing.vdb"}), HasSubstr(dir / "nothing.vdb"));
}

TEST_F(DiffErrors, RefusesATruncatedOpenVdbFile) {
  writeVdb(dir / "blob.vdb", {blobGrid({0, 0, 0}, 9)});
  fs::resize_file(dir / "blob.vdb", fs::file_size(dir / "blob.vdb") * 2 / 3);
  EXPECT_THAT(failure(1, {dir / "blob.vdb"}), HasSubstr(dir / "blob.vdb"));
}

TEST_F(DiffErrors, ListsTheGridsWhereTheNamedOneIsMissing) {
  auto temperature = blobGrid({0, 0, 0}, 6, 2);
  temperature->setName("temperature");
  writeVdb(dir / "two.vdb", {blobGrid({0, 0, 0}, 5), temperature});
  EXPECT_THAT(failure(1, {dir / "two.vdb", "--grid", "heat"}),
              AllOf(HasSubstr("heat"), HasSubstr("density"), HasSubstr("temperature")));
}

TEST_F(DiffErrors, ListsTheGridsBetweenWhichItCannotChoose) {
  auto heat = blobGrid({0, 0, 0}, 6, 2), fuel = blobGrid({1, 0, 0}, 4, 3);
  heat->setName("heat");
  fuel->setName("fuel");
  writeVdb(dir / "two.vdb", {heat, fuel});
  EXPECT_THAT(failure(1, {dir / "two.vdb"}),
              AllOf(HasSubstr("heat"), HasSubstr("fuel"), HasSubstr("--grid")));
}

TEST_F(DiffErrors, SaysWhichStepBreaksTheSeries) {
  writeVdb(dir / "vdb_01.vdb", {blobGrid({0, 0, 0}, 5)});
  auto finer = blobGrid({0, 0, 0}, 5);
  finer->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  writeVdb(dir / "vdb_02.vdb", {finer});
  EXPECT_THAT(failure(1, {dir / "vdb_##.vdb"}),
              AllOf(HasSubstr("vdb_02.vdb"), HasSubstr("step 2"), HasSubstr("voxel size")));
}

TEST_F(DiffErrors, RefusesAbsurdOptionValues) {
  const std::string sim = dir / "sim";
  const Arguments absurd[] = {{"--tolerance", "-1"},
                              {"--tolerance", "nan"},
                              {"--tolerance", "inf"},
                              {"--tolerance", "1e999"},
                              {"--tolerance", "little"},
                              {"--tolerance", "1x"},
                              {"--key-every", "-2"},
                              {"--key-every", "1.5"},
                              {"--threads", "-1"},
                              {"--threads", "999999"},
                              {"--threads", "99999999999999999999"},
                              {"--voxel-size", "0"},
                              {"--voxel-size", "-1"},
                              {"--voxel-size", "1,2"},
                              {"--voxel-size", "nan"}};
  for (const Arguments& option : absurd) {
    const std::string line = failure(2, Arguments{sim} + raw + option);
    EXPECT_THAT(line, AllOf(HasSubstr(option[0]), HasSubstr(option[1]), HasSubstr("expected")));
  }
  for (const char* dims :
       {"0,1,1", "-5,5,5", "20,17", "20,17,12,1", "20x17x12", ",,", "2000000,1,1", "1048576,1048576,1048576"})
    EXPECT_THAT(failure(2, {sim, "--dims", dims, "--type", "u8"}),
                AllOf(HasSubstr("--dims"), HasSubstr(dims)));
  EXPECT_THAT(failure(2, {sim, "--dims", "20,17,12", "--type", "i8"}),
              AllOf(HasSubstr("--type"), HasSubstr("u8, u16 or f32")));
}

TEST_F(DiffErrors, RefusesOptionsThatContradictEachOther) {
  const std::string sim = dir / "sim";
  EXPECT_THAT(failure(2, {sim, "--dims", "20,17,12"}), HasSubstr("--type"));
  EXPECT_THAT(failure(2, {sim, "--type", "u8"}), HasSubstr("--dims"));
  EXPECT_THAT(failure(2, {sim, "--voxel-size", "2"}), HasSubstr("--dims"));
  EXPECT_THAT(failure(2, Arguments{sim, "--grid", "density"} + raw), HasSubstr("--grid"));
  writeVdb(dir / "blob.vdb", {blobGrid({0, 0, 0}, 5)});
  EXPECT_THAT(failure(2, Arguments{dir / "blob.vdb"} + raw),
              AllOf(HasSubstr("--dims"), HasSubstr("blob.vdb")));
}

TEST_F(DiffErrors, AsksForInputAndOutput) {
  const ProgramResult noOutput = runProgram(Arguments{"diff", dir / "sim"} + raw);
  EXPECT_EQ(noOutput.exitCode, 2);
  EXPECT_THAT(noOutput.err, HasSubstr("--output"));
  EXPECT_THAT(failure(2, {}), HasSubstr("INPUT"));
  EXPECT_THAT(failure(2, Arguments{dir / "sim", "--tolerence", "2"} + raw), HasSubstr("--tolerence"));
}

TEST_F(DiffErrors, RefusesAnOutputThatIsAFile) {
  std::ofstream(dir / "file") << "precious";
  EXPECT_THAT(failure(1, Arguments{dir / "sim"} + raw, dir / "file"), HasSubstr(dir / "file"));
  EXPECT_EQ(fileContents(dir / "file"), "precious");
}

TEST_F(DiffErrors, RefusesAnOutputThatCannotBeMade) {
  EXPECT_THAT(failure(1, Arguments{dir / "sim"} + raw, "/proc/kairos/seq"), HasSubstr("/proc/kairos"));
}

TEST_F(DiffErrors, RefusesAnOutputWhereTheInputStands) {
  EXPECT_THAT(failure(2, Arguments{dir / "sim"} + raw, dir / "sim"),
              AllOf(HasSubstr("--output"), HasSubstr("INPUT")));
}

TEST_F(DiffErrors, ReportsAFullDiskAndLeavesNoPartialFile) {
  const ProgramResult result =
      runProgram(Arguments{"diff", dir / "sim", "-o", dir / "seq"} + raw, {uint64_t(600), {}});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, HasSubstr(dir / "seq"));
  EXPECT_THAT(fileNames(dir / "seq"), testing::IsEmpty());
}

}  // namespace
}  // namespace kairos::test
