#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/error.h"
#include "io/input_series.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class StepFiles : public testing::Test {
 protected:
  void make(std::initializer_list<const char*> names) {
    for (const char* name : names) directory_.write(name, "x");
  }
  // "name:step" of each file found, inputs relative to the directory.
  std::vector<std::string> find(std::vector<std::string> inputs) {
    for (std::string& input : inputs) input = directory_ / input;
    std::vector<std::string> found;
    for (const StepFile& f : findStepFiles(inputs))
      found.push_back(std::filesystem::relative(f.path, directory_.path()).string() + ":" +
                      std::to_string(f.step));
    return found;
  }
  test::TemporaryDirectory directory_;
};

TEST_F(StepFiles, NumbersComeFromTheNamesAndMayStartAnywhere) {
  make({"s_0021.vdb", "s_0022.vdb", "s_0024.vdb", "note.txt", ".s_0023.vdb"});
  EXPECT_THAT(find({""}), ElementsAre("s_0021.vdb:21", "s_0022.vdb:22", "s_0024.vdb:24"));
}

TEST_F(StepFiles, OrderIsNaturalNotAlphabetical) {
  make({"s2.raw", "s10.raw", "s1.raw"});
  EXPECT_THAT(find({"s10.raw", "s2.raw", "s1.raw"}), ElementsAre("s1.raw:1", "s2.raw:2", "s10.raw:10"));
}

TEST_F(StepFiles, HashPatternsMatchWholeNumbersOfThatWidth) {
  make({"s_0009.raw", "s_0010.raw", "s_12345.raw", "s_012345.raw", "s_abcd.raw", "s_01.raw",
        "s_0010.raw.bak"});
  EXPECT_THAT(find({"s_####.raw"}), ElementsAre("s_0009.raw:9", "s_0010.raw:10", "s_12345.raw:12345"));
}

TEST_F(StepFiles, PrintfPatternsWork) {
  make({"s_0009.raw", "s_0010.raw", "s_7.raw"});
  EXPECT_THAT(find({"s_%04d.raw"}), ElementsAre("s_0009.raw:9", "s_0010.raw:10"));
  EXPECT_THAT(find({"s_%d.raw"}), ElementsAre("s_7.raw:7"));
}

TEST_F(StepFiles, ThePatternSaysWhichNumberIsTheStep) {
  make({"s_0001_v2.raw", "s_0002_v2.raw"});
  EXPECT_THAT(find({"s_####_v2.raw"}), ElementsAre("s_0001_v2.raw:1", "s_0002_v2.raw:2"));
}

TEST_F(StepFiles, GlobsWork) {
  make({"a1.raw", "a2.raw", "b3.raw"});
  EXPECT_THAT(find({"a*.raw"}), ElementsAre("a1.raw:1", "a2.raw:2"));
  EXPECT_THAT(find({"[ab][13].raw"}), ElementsAre("a1.raw:1", "b3.raw:3"));
}

TEST_F(StepFiles, PositionsCountWhereNamesShareANumberOrHaveNone) {
  make({"run1/s_1.raw", "run2/s_1.raw", "x.raw", "y7.raw"});
  EXPECT_THAT(find({"run1", "run2"}), ElementsAre("run1/s_1.raw:0", "run2/s_1.raw:1"));
  EXPECT_THAT(find({"x.raw", "y7.raw"}), ElementsAre("x.raw:0", "y7.raw:1"));
}

TEST_F(StepFiles, TheExtensionIsNoNumberUnlessItIsNothingElse) {
  make({"jet.0012.u8", "jet.0013.u8", "run2.0001", "run2.0002"});
  EXPECT_THAT(find({"jet.*.u8"}), ElementsAre("jet.0012.u8:12", "jet.0013.u8:13"));
  EXPECT_THAT(find({"run2.*"}), ElementsAre("run2.0001:1", "run2.0002:2"));
}

TEST_F(StepFiles, ANameThatExistsIsNoPattern) {
  make({"a#1.raw", "a[1].raw"});
  EXPECT_THAT(find({"a#1.raw"}), ElementsAre("a#1.raw:1"));
  EXPECT_THAT(find({"a[1].raw"}), ElementsAre("a[1].raw:1"));
}

TEST_F(StepFiles, TheSameFileTwiceIsOneStep) {
  make({"a1.raw", "a2.raw"});
  EXPECT_THAT(find({"a1.raw", "a*.raw"}), ElementsAre("a1.raw:1", "a2.raw:2"));
}

TEST_F(StepFiles, NothingFoundIsAnError) {
  make({"sub/x.txt"});
  EXPECT_THROW(find({"none.vdb"}), InputError);
  EXPECT_THROW(find({"none_####.vdb"}), InputError);
  EXPECT_THROW(find({"none*.vdb"}), InputError);
  EXPECT_THROW(findStepFiles({}), InputError);
  EXPECT_THAT(test::messageOf<InputError>([&] { find({"sub"}); }), HasSubstr("without .vdb or .raw files"));
}

TEST_F(StepFiles, ADirectoryOfBothKindsIsAmbiguous) {
  make({"a1.raw", "a1.vdb"});
  EXPECT_THAT(test::messageOf<InputError>([&] { find({""}); }), HasSubstr(".vdb and .raw"));
}

}  // namespace
}  // namespace kairos
