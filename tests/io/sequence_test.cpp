#include "io/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "core/error.h"
#include "io/series.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using test::movingBlob;
using test::TemporaryDirectory;
using test::writeSequence;
using testing::HasSubstr;

class SequenceOfType : public testing::TestWithParam<ElementType> {};

TEST_P(SequenceOfType, TheChainRebuildsEveryStepExactly_D1) {
  const TemporaryDirectory directory;
  const std::vector<Field> fields = movingBlob(GetParam(), 12);
  writeSequence(directory / "seq", fields);
  const SequenceReader reader(directory / "seq");
  ASSERT_EQ(reader.stepCount(), fields.size());
  Field state = reader.readKey(0);
  EXPECT_TRUE(test::sameState(state, fields[0]));
  for (size_t i = 1; i < fields.size(); ++i) {
    const ChangedVoxels changes = reader.readChanges(i),
                        expected = test::changesBetween(fields[i - 1], fields[i]);
    EXPECT_EQ(contentChecksum(changes), contentChecksum(expected));
    EXPECT_EQ(changes.stateBefore, expected.stateBefore);
    EXPECT_EQ(changes.stateAfter, expected.stateAfter);
    EXPECT_GT(changes.count(), 0u);
    applyChanges(changes, state);
    ASSERT_TRUE(test::sameState(state, fields[i])) << i;
  }
}

TEST_P(SequenceOfType, AnyStepIsReachedFromTheNearestKeyFrame) {
  const TemporaryDirectory directory;
  const std::vector<Field> fields = movingBlob(GetParam(), 8);
  writeSequence(directory / "seq", fields, 3);
  std::filesystem::remove(directory / "seq/diff.0023.vdb");  // not on the way from key 24 on
  const SequenceReader reader(directory / "seq");
  for (size_t i : {size_t(0), size_t(1), size_t(3), size_t(5), size_t(7)})
    EXPECT_TRUE(test::sameState(reader.readStep(i), fields[i])) << i;
  EXPECT_THROW(reader.readStep(2), InputError);
}

// The paper stores 4 bytes per changed voxel: three for its place, one for its value.
TEST_P(SequenceOfType, BytesPerChangedVoxelAreReported_D2) {
  const TemporaryDirectory directory;
  writeSequence(directory / "seq", movingBlob(GetParam(), 6, 96));
  const SequenceReader reader(directory / "seq");
  double bytes = 0, voxels = 0;
  for (size_t i = 1; i < reader.stepCount(); ++i) {
    bytes += double(reader.bytes(i));
    voxels += double(reader.manifest().steps[i].changedVoxels);
  }
  std::printf("%s: %.2f bytes per changed voxel (the paper: 4)\n", std::string(name(GetParam())).c_str(),
              bytes / voxels);
  RecordProperty("bytes_per_changed_voxel", std::to_string(bytes / voxels));
  EXPECT_LT(bytes / voxels, 4);
}

INSTANTIATE_TEST_SUITE_P(Types, SequenceOfType,
                         testing::Values(ElementType::u8, ElementType::u16, ElementType::f32),
                         [](const auto& test) { return std::string(name(test.param)); });

TEST(Sequence, TheManifestComesBack) {
  const TemporaryDirectory directory;
  const std::vector<Field> fields = movingBlob(ElementType::f32, 4);
  SequenceManifest manifest = test::manifestFor(fields);
  manifest.lattice.background = 0;
  manifest.tolerance = 0.1;
  manifest.keyEvery = 2;
  SequenceWriter writer(directory / "seq", manifest, false);
  test::writeSteps(writer, fields, 0, 4, 2);
  EXPECT_FALSE(readManifest(directory / "seq").complete);
  writer.finish();
  const SequenceManifest found = readManifest(directory / "seq");
  EXPECT_TRUE(found.complete);
  EXPECT_EQ(found.lattice.worldFromIndex, manifest.lattice.worldFromIndex);
  EXPECT_EQ(found.lattice.domain, manifest.lattice.domain);
  EXPECT_EQ(found.inputs, manifest.inputs);
  EXPECT_EQ(found.tolerance, 0.1);
  EXPECT_EQ(found.keyEvery, 2);
  EXPECT_EQ(found.steps[2].step, 23);
  EXPECT_TRUE(found.steps[2].key && found.steps[2].differential);
  EXPECT_EQ(found.steps[2].bytes, std::filesystem::file_size(directory / "seq/key.0023.vdb") +
                                      std::filesystem::file_size(directory / "seq/diff.0023.vdb"));
  EXPECT_EQ(found.steps[2].stateChecksum, stateChecksum(fields[2]));
  EXPECT_EQ(found.steps[2].range, (test::entryFor(fields[2], 0, nullptr).range));
  EXPECT_GT(found.steps[2].nonFinite, 0);
  EXPECT_TRUE(isSequence(directory / "seq"));
  EXPECT_FALSE(isSequence(directory.path()));
}

TEST(Sequence, EqualContentGivesEqualFiles) {
  const TemporaryDirectory directory;
  const std::vector<Field> fields = movingBlob(ElementType::u8, 3);
  writeSequence(directory / "a", fields);
  writeSequence(directory / "b", fields);
  for (const char* name : {"sequence.json", "key.0021.vdb", "diff.0022.vdb", "diff.0023.vdb"})
    EXPECT_EQ(test::readBytes(directory / "a/" + name), test::readBytes(directory / "b/" + name)) << name;
}

TEST(Sequence, AStepWithoutChangesIsAnEmptyFile) {
  const TemporaryDirectory directory;
  const Field field = movingBlob(ElementType::u16, 1).front();
  writeSequence(directory / "seq", {field, field});
  const SequenceReader reader(directory / "seq");
  EXPECT_TRUE(reader.readChanges(1).empty());
  EXPECT_TRUE(test::sameState(reader.readStep(1), field));
}

TEST(Sequence, FieldsWithABackgroundReturnToIt) {
  const TemporaryDirectory directory;
  const std::vector<float> low(512, -1), high(512, 3);
  std::vector<Field> fields{fieldFromDense(high.data(), {8, 8, 8}, -1.0f),
                            fieldFromDense(low.data(), {8, 8, 8}, -1.0f)};
  SequenceManifest manifest = test::manifestFor(fields);
  manifest.lattice.background = -1;
  SequenceWriter writer(directory / "seq", manifest, false);
  test::writeSteps(writer, fields, 0, 2);
  writer.finish();
  const SequenceReader reader(directory / "seq");
  EXPECT_EQ(reader.readChanges(1).count(), 512u);
  EXPECT_TRUE(test::sameState(reader.readStep(1), fields[1]));
}

TEST(Sequence, AFileOfAnotherStepIsRefused) {
  const TemporaryDirectory directory;
  writeSequence(directory / "seq", movingBlob(ElementType::u8, 4));
  std::filesystem::copy_file(directory / "seq/diff.0023.vdb", directory / "seq/diff.0024.vdb",
                             std::filesystem::copy_options::overwrite_existing);
  const SequenceReader reader(directory / "seq");
  EXPECT_THAT(test::messageOf<InputError>([&] { reader.readChanges(3); }), HasSubstr("diff.0024.vdb"));
}

TEST(Sequence, ChangesOfAnotherStateAreNeverWritten) {
  const TemporaryDirectory directory;
  const std::vector<Field> fields = movingBlob(ElementType::u8, 3);
  SequenceWriter writer(directory / "seq", test::manifestFor(fields), false);
  test::writeSteps(writer, fields, 0, 1);
  const ChangedVoxels wrong = test::changesBetween(fields[1], fields[2]);
  EXPECT_THROW(writer.write(test::entryFor(fields[2], 23, &wrong), nullptr, &wrong), StateError);
  EXPECT_FALSE(std::filesystem::exists(directory / "seq/diff.0023.vdb"));
}

TEST(Sequence, MissingPartsAreNamed) {
  const TemporaryDirectory directory;
  writeSequence(directory / "seq", movingBlob(ElementType::u8, 2));
  const SequenceReader reader(directory / "seq");
  EXPECT_THROW(reader.readChanges(0), InputError);
  EXPECT_THROW(reader.readKey(1), InputError);
  EXPECT_THROW(readManifest(directory.path()), InputError);
  std::filesystem::remove(directory / "seq/diff.0022.vdb");
  EXPECT_THAT(test::messageOf<InputError>([&] { reader.readChanges(1); }),
              HasSubstr("diff.0022.vdb: cannot be opened"));
}

TEST(Sequence, AnEditedManifestIsNoticed) {
  const TemporaryDirectory directory;
  writeSequence(directory / "seq", movingBlob(ElementType::u8, 2));
  std::string text = test::readBytes(directory / "seq/sequence.json");
  text.replace(text.find("\"tolerance\": 0"), 14, "\"tolerance\": 1");
  directory.write("seq/sequence.json", text);
  EXPECT_THAT(test::messageOf<InputError>([&] { readManifest(directory / "seq"); }),
              HasSubstr("damaged or edited"));
}

}  // namespace
}  // namespace kairos
