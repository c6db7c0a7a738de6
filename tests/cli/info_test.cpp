// `kairos info`: what it shows of sequences and files, and what it notices of damage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/simulations.h"
#include "io/sequence.h"
#include "io/vdb_files.h"

namespace kairos::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kSteps = 9;

class Info : public testing::Test {
 protected:
  const ScratchDirectory dir;
  const std::string sequence = dir / "seq";

  void SetUp() override { makeSequence({}); }

  void makeSequence(const Arguments& options) const {
    writeWaves<float>(dir / "sim", 2, kSteps);
    const ProgramResult result =
        runProgram(Arguments{"diff", dir / "sim", "-o", sequence, "--overwrite", "--key-every", "4"} +
                   rawArguments(ElementType::f32) + options);
    ASSERT_EQ(result.exitCode, 0) << result.err;
  }

  json infoJson(const Arguments& arguments, int code = 0) const {
    const ProgramResult result = runProgram(Arguments{"info", "--json"} + arguments);
    EXPECT_EQ(result.exitCode, code) << result.err;
    return json::parse(result.out);
  }

  // Flips a bit in the middle of a file of the sequence.
  void damage(const std::string& name) const {
    std::string bytes = fileContents(sequence + "/" + name);
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 4);
    std::ofstream(sequence + "/" + name, std::ios::binary) << bytes;
  }

  // Expects damage and returns the problems found.
  std::vector<std::string> problems(size_t stepsRebuilt) const {
    const json verified = infoJson({sequence, "--verify"}, 1)["verified"];
    EXPECT_FALSE(verified["sound"]);
    EXPECT_EQ(verified["steps_rebuilt"], stepsRebuilt);
    return verified["problems"];
  }
};

TEST_F(Info, DescribesASequence) {
  const ProgramResult result = runProgram({"info", sequence});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  for (const char* part : {"sequence of 9 steps, 2 to 10", "f32", "20 x 17 x 12 voxels", "every step exact",
                           "3 (steps 2, 6, 10)", "bytes per changed voxel (the paper: 4)", "median", "####"})
    EXPECT_THAT(result.out, HasSubstr(part));
  EXPECT_THAT(result.out, Not(HasSubstr("verified"))) << "only when asked";
}

TEST_F(Info, GivesTheManifestAsJson) {
  const json info = infoJson({sequence});
  const SequenceManifest manifest = readManifest(sequence);
  EXPECT_EQ(info["kind"], "sequence");
  EXPECT_EQ(info["complete"], true);
  EXPECT_EQ(info["element_type"], "f32");
  EXPECT_EQ(info["domain"]["size"], json({20, 17, 12}));
  EXPECT_EQ(info["voxel_size"], json({1, 1, 1}));
  EXPECT_EQ(info["tolerance"], 0);
  EXPECT_EQ(info["key_frames"], 3);
  EXPECT_EQ(info["range"][1].get<float>(), manifest.range().hi);
  ASSERT_EQ(info["steps"].size(), size_t(kSteps));
  uint64_t changed = 0, bytes = 0;
  for (size_t i = 0; i < kSteps; ++i) {
    const json& step = info["steps"][i];
    EXPECT_EQ(step["step"], 2 + int(i));
    EXPECT_EQ(step["key"], i % 4 == 0);
    EXPECT_EQ(step["changed_voxels"], manifest.steps[i].changedVoxels);
    EXPECT_EQ(step["non_finite"], manifest.steps[i].nonFinite);
    changed += manifest.steps[i].changedVoxels;
    bytes += manifest.steps[i].differentialBytes;
  }
  EXPECT_EQ(info["changed_voxels"], changed);
  EXPECT_NEAR(info["bytes_per_changed_voxel"], double(bytes) / double(changed), 1e-12);
}

TEST_F(Info, VerifiesASoundSequence) {
  for (const Arguments& options : {Arguments{}, Arguments{"--tolerance", "3"}}) {
    makeSequence(options);
    const json verified = infoJson({sequence, "--verify"})["verified"];
    EXPECT_EQ(verified["sound"], true);
    EXPECT_EQ(verified["steps_rebuilt"], kSteps);
    EXPECT_THAT(runProgram({"info", sequence, "--verify"}).out, HasSubstr("sound: 9 steps read and rebuilt"));
  }
}

TEST_F(Info, NamesADamagedDifferentialFileAndGoesOnAtTheNextKeyFrame) {
  damage("diff.0004.vdb");
  const auto found = problems(7);  // steps 4 and 5 are lost, 6 is a key frame
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0], HasSubstr("diff.0004.vdb"));
  EXPECT_THAT(runProgram({"info", sequence, "--verify"}).out,
              AllOf(HasSubstr("DAMAGED"), HasSubstr("diff.0004.vdb")));
  EXPECT_EQ(runProgram({"info", sequence}).exitCode, 0) << "without --verify nothing is read";
}

TEST_F(Info, NamesADamagedKeyFrameThatTheChainDoesNotNeed) {
  damage("key.0006.vdb");
  const auto found = problems(9);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0], HasSubstr("key.0006.vdb"));
}

TEST_F(Info, NamesEveryDamagedMissingOrTruncatedFile) {
  damage("key.0002.vdb");
  fs::remove(sequence + "/diff.0007.vdb");
  fs::resize_file(sequence + "/diff.0009.vdb", 50);
  const auto found = problems(2);  // the key frames of steps 6 and 10
  ASSERT_EQ(found.size(), 3u);
  EXPECT_THAT(found[0], HasSubstr("key.0002.vdb"));
  EXPECT_THAT(found[1], HasSubstr("diff.0007.vdb"));
  EXPECT_THAT(found[2], HasSubstr("diff.0009.vdb"));
}

TEST_F(Info, NamesAFileThatBelongsToAnotherStep) {
  fs::copy_file(sequence + "/diff.0003.vdb", sequence + "/diff.0005.vdb",
                fs::copy_options::overwrite_existing);
  const auto found = problems(8);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0], HasSubstr("diff.0005.vdb"));
}

TEST_F(Info, RefusesADamagedManifest) {
  damage("sequence.json");
  const ProgramResult result = runProgram({"info", sequence});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("sequence.json"));
}

TEST_F(Info, RefusesInputOptionsForASequence) {
  for (const Arguments& options :
       {Arguments{"--grid", "density"}, Arguments{"--dims", "1,1,1"}, Arguments{"--type", "u8"}}) {
    const ProgramResult result = runProgram(Arguments{"info", sequence} + options);
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_THAT(result.err, HasSubstr(options[0]));
  }
}

TEST_F(Info, DescribesRawFiles) {
  const Arguments files = Arguments{dir / "sim"} + rawArguments(ElementType::f32);
  const json info = infoJson(files);
  EXPECT_EQ(info["kind"], "series");
  EXPECT_EQ(info["dense"], true);
  EXPECT_EQ(info["bytes"], kSteps * 20 * 17 * 12 * 4);
  ASSERT_EQ(info["steps"].size(), size_t(kSteps));
  EXPECT_EQ(info["steps"][0]["step"], 2);
  EXPECT_FALSE(info.contains("range")) << "values are read only when asked";
  EXPECT_THAT(runProgram(Arguments{"info"} + files).out,
              AllOf(HasSubstr("9 steps, 2 to 10"), HasSubstr("20 x 17 x 12")));

  const json verified = infoJson(files + Arguments{"--verify"});
  EXPECT_EQ(verified["range"][1].get<float>(), readManifest(sequence).range().hi);
  int64_t nonFinite = 0;
  for (const SequenceStep& s : readManifest(sequence).steps) nonFinite += s.nonFinite;
  EXPECT_EQ(verified["non_finite"], nonFinite);
}

TEST_F(Info, RefusesRawFilesOfTheWrongSize) {
  const ProgramResult result = runProgram({"info", dir / "sim", "--dims", "20,17,11", "--type", "f32"});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_THAT(result.err, HasSubstr("wave_0002.raw"));
}

openvdb::FloatGrid::Ptr namedBlob(const std::string& name, int radius) {
  auto grid = blobGrid({0, 0, 0}, radius);
  grid->setName(name);
  return grid;
}

TEST_F(Info, ListsTheGridsOfAFileAndMarksTheOneThatIsRead) {
  writeVdb(dir / "fire.vdb", {namedBlob("heat", 5), namedBlob("density", 6)});
  const ProgramResult result = runProgram({"info", dir / "fire.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("heat"), HasSubstr("density"), HasSubstr("<- read")));
  EXPECT_EQ(infoJson({dir / "fire.vdb"})["grid"], "density");
  EXPECT_EQ(infoJson({dir / "fire.vdb", "--grid", "heat"})["grid"], "heat");
}

TEST_F(Info, ListsTheGridsBetweenWhichNoneCanBeChosen) {
  writeVdb(dir / "fire.vdb", {namedBlob("heat", 5), namedBlob("fuel", 6)});
  const ProgramResult result = runProgram({"info", dir / "fire.vdb"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("heat"), HasSubstr("fuel"), HasSubstr("--grid"), Not(HasSubstr("<- read"))));
  const json info = infoJson({dir / "fire.vdb"});
  EXPECT_EQ(info["kind"], "file");
  ASSERT_EQ(info["grids"].size(), 2u);
  EXPECT_EQ(info["grids"][0]["type"], "float");
  EXPECT_EQ(info["grids"][0]["scalar"], true);
}

TEST_F(Info, FindsDamageInSimulationFiles) {
  writeVdb(dir / "blob.vdb", {blobGrid({0, 0, 0}, 9)},
           openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
  EXPECT_EQ(infoJson({dir / "blob.vdb", "--verify"})["verified"]["sound"], true);
  std::string bytes = fileContents(dir / "blob.vdb");
  for (size_t i = bytes.size() * 3 / 4; i < bytes.size() * 3 / 4 + 40; ++i) bytes[i] = char(0xff);
  std::ofstream(dir / "blob.vdb", std::ios::binary) << bytes;
  const json info = infoJson({dir / "blob.vdb", "--verify"}, 1);
  EXPECT_EQ(info["verified"]["sound"], false);
  EXPECT_THAT(info["verified"]["problems"][0], HasSubstr("blob.vdb"));
}

TEST_F(Info, RefusesWhatIsNothingItKnows) {
  std::ofstream(dir / "text.vdb") << "no volume";
  for (const std::string& path : {dir / "text.vdb", dir / "missing.vdb"}) {
    const ProgramResult result = runProgram({"info", path});
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_THAT(result.err, HasSubstr(path));
  }
}

}  // namespace
}  // namespace kairos::test
