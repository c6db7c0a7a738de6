#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "io/sequence.h"
#include "io/series.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::HasSubstr;

class SequenceResume : public testing::Test {
 protected:
  // Writes the first `count` steps and stops, as an interrupted run does.
  void interruptAfter(size_t count) {
    SequenceWriter writer(path(), manifest_, false);
    test::writeSteps(writer, fields_, 0, count);
  }
  std::string refusal() {
    return test::messageOf<OutputError>([&] { SequenceWriter(path(), manifest_, false); });
  }
  std::string path() const { return directory_ / "seq"; }

  test::TemporaryDirectory directory_;
  std::vector<Field> fields_ = test::movingBlob(ElementType::u8, 6);
  SequenceManifest manifest_ = test::manifestFor(fields_);
};

TEST_F(SequenceResume, GoesOnAfterTheLastStepAndEndsWithTheSameFiles) {
  interruptAfter(3);
  SequenceWriter writer(path(), manifest_, false);
  EXPECT_EQ(writer.manifest().steps.size(), 3u);
  test::writeSteps(writer, fields_, 3, fields_.size());
  writer.finish();
  test::writeSequence(directory_ / "whole", fields_);
  for (const char* name : {"sequence.json", "key.0021.vdb", "diff.0024.vdb", "diff.0026.vdb"})
    EXPECT_EQ(test::readBytes(path() + "/" + name), test::readBytes(directory_ / "whole/" + name)) << name;
}

TEST_F(SequenceResume, NamesThatAreNotUtf8AreNoObstacle) {
  manifest_.gridName = "dichte\xfc";
  for (std::string& input : manifest_.inputs) input += "\xe4";
  interruptAfter(3);
  SequenceWriter writer(path(), manifest_, false);
  EXPECT_EQ(writer.manifest().steps.size(), 3u);
  test::writeSteps(writer, fields_, 3, fields_.size());
  writer.finish();
  EXPECT_TRUE(test::sameState(SequenceReader(path()).readStep(5), fields_[5]));
  EXPECT_THAT(refusal(), HasSubstr("finished"));
  manifest_.gridName = "druck\xfc";
  EXPECT_THAT(refusal(), HasSubstr("grid"));
}

// Renewing the manifest after each of thousands of steps would cost more than the steps.
TEST_F(SequenceResume, ALongSequencesManifestFollowsInTheEnd) {
  while (fields_.size() < 68) fields_.push_back(fields_[fields_.size() % 6]);
  manifest_ = test::manifestFor(fields_);
  {
    SequenceWriter writer(path(), manifest_, false);
    test::writeSteps(writer, fields_, 0, 64);
    EXPECT_EQ(readManifest(path()).steps.size(), 64u);
    test::writeSteps(writer, fields_, 64, 67);
    EXPECT_LT(readManifest(path()).steps.size(), 67u);
  }
  EXPECT_EQ(readManifest(path()).steps.size(), 67u);
  interruptAfter(0);
  EXPECT_EQ(readManifest(path()).steps.size(), 67u);
}

TEST_F(SequenceResume, StepsWhoseFilesAreGoneAreDoneAgain) {
  interruptAfter(4);
  std::filesystem::remove(path() + "/diff.0023.vdb");
  EXPECT_EQ(SequenceWriter(path(), manifest_, false).manifest().steps.size(), 2u);
}

TEST_F(SequenceResume, RefusesAnotherSequenceSayingWhatDiffers) {
  interruptAfter(2);
  manifest_.tolerance = 0.5;
  EXPECT_THAT(refusal(), HasSubstr("tolerance 0.0 instead of 0.5"));
  manifest_.tolerance = 0;
  manifest_.keyEvery = 10;
  EXPECT_THAT(refusal(), HasSubstr("key_every"));
  manifest_.keyEvery = 0;
  manifest_.gridName = "temperature";
  EXPECT_THAT(refusal(), HasSubstr("grid"));
  manifest_.gridName = "density";
  manifest_.inputs.pop_back();
  EXPECT_THAT(refusal(), HasSubstr("inputs"));
  manifest_.inputs.push_back("other.raw");
  EXPECT_THAT(refusal(), HasSubstr("other input files"));
}

TEST_F(SequenceResume, RefusesAFinishedOneUnlessToldToOverwrite) {
  test::writeSequence(path(), fields_);
  EXPECT_THAT(refusal(), HasSubstr("finished"));
  SequenceWriter writer(path(), manifest_, true);
  EXPECT_TRUE(writer.manifest().steps.empty());
  EXPECT_FALSE(std::filesystem::exists(path() + "/diff.0022.vdb"));
  EXPECT_FALSE(isSequence(path()));
}

TEST_F(SequenceResume, OverwritingKeepsForeignFiles) {
  test::writeSequence(path(), fields_);
  directory_.write("seq/notes.txt", "mine");
  directory_.write("seq/key.vdb", "mine");
  SequenceWriter writer(path(), manifest_, true);
  EXPECT_TRUE(std::filesystem::exists(path() + "/notes.txt"));
  EXPECT_TRUE(std::filesystem::exists(path() + "/key.vdb"));
}

TEST_F(SequenceResume, RefusesADamagedManifest) {
  interruptAfter(2);
  directory_.write("seq/sequence.json", "{}");
  EXPECT_THAT(refusal(), HasSubstr("cannot be resumed"));
}

TEST_F(SequenceResume, StepsMustComeInOrderAndBeComplete) {
  SequenceWriter writer(path(), manifest_, false);
  EXPECT_THROW(writer.write(test::entryFor(fields_[0], 21, nullptr), nullptr, nullptr), StateError);
  test::writeSteps(writer, fields_, 0, 1);
  const ChangedVoxels changes = test::changesBetween(fields_[0], fields_[1]);
  EXPECT_THROW(writer.write(test::entryFor(fields_[1], 21, &changes), nullptr, &changes), StateError);
  EXPECT_THROW(writer.write(test::entryFor(fields_[1], 22, nullptr), nullptr, nullptr), StateError);
}

TEST_F(SequenceResume, AnUnusableDirectoryIsAnOutputError) {
  directory_.write("file", "");
  EXPECT_THROW(SequenceWriter(directory_ / "file", manifest_, false), OutputError);
  EXPECT_THROW(SequenceWriter(directory_ / "file/seq", manifest_, false), OutputError);
}

}  // namespace
}  // namespace kairos
