#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "io/image_file.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

TEST(FramePath, PadsTheStepToThePlace) {
  EXPECT_EQ(framePath("out/frame.####.exr", 21), "out/frame.0021.exr");
  EXPECT_EQ(framePath("frame.%06d.exr", 21), "frame.000021.exr");
  EXPECT_EQ(framePath("frame.%d.exr", 21), "frame.21.exr");
  EXPECT_EQ(framePath("f#.exr", 12345), "f12345.exr");
  EXPECT_EQ(framePath("f##.exr", -3), "f-03.exr");
}

TEST(FramePath, UsesTheLastPlaceOfTheFileNameOnly) {
  EXPECT_EQ(framePath("take##/frame.exr", 7), "take##/frame.exr");
  EXPECT_EQ(framePath("take##/a#_b##.exr", 7), "take##/a#_b07.exr");
}

TEST(OutputPattern, AcceptsWhatCanBeWrittenAndCreatesTheDirectory) {
  const test::TemporaryDirectory directory;
  checkOutputPattern(directory / "new/frame.####.exr");
  EXPECT_TRUE(std::filesystem::is_directory(directory / "new"));
  EXPECT_TRUE(std::filesystem::is_empty(directory / "new"));
}

TEST(OutputPattern, RefusesOtherExtensionsAndMissingPlaces) {
  EXPECT_THROW(checkOutputPattern("frame.####.png"), OptionError);
  EXPECT_THROW(checkOutputPattern("frame.exr"), OptionError);
  EXPECT_NO_THROW(checkOutputPattern("frame.exr", true));
  EXPECT_THROW(checkOutputPattern("/proc/none/frame.####.exr"), OutputError);
}

}  // namespace
}  // namespace kairos
