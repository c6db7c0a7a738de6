#include "io/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "core/error.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using test::TemporaryDirectory;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Makes every write beyond `bytes` fail as on a full disk, as long as it lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit old_{};
  sighandler_t handler_;
};

TEST(AtomicFile, ReplacesTheFileAndLeavesNothingElse) {
  const TemporaryDirectory directory;
  writeFileAtomically(directory / "a", "old");
  writeFileAtomically(directory / "a", "new content");
  EXPECT_EQ(test::readBytes(directory / "a"), "new content");
  EXPECT_THAT(directory.names(), ElementsAre("a"));
}

TEST(AtomicFile, FailsOnAFullDiskWithoutAPartialFile) {
  const TemporaryDirectory directory;
  const FileSizeLimit limit(1000);
  const std::string message =
      test::messageOf<OutputError>([&] { writeFileAtomically(directory / "a", std::string(5000, 'x')); });
  EXPECT_THAT(message, HasSubstr(directory / "a"));
  EXPECT_THAT(message, HasSubstr("cannot be written"));
  EXPECT_THAT(directory.names(), IsEmpty());
}

TEST(AtomicFile, KeepsTheOldFileWhenTheNewOneCannotBeWritten) {
  const TemporaryDirectory directory;
  writeFileAtomically(directory / "a", "old");
  const FileSizeLimit limit(1000);
  EXPECT_THROW(writeFileAtomically(directory / "a", std::string(5000, 'x')), OutputError);
  EXPECT_EQ(test::readBytes(directory / "a"), "old");
  EXPECT_THAT(directory.names(), ElementsAre("a"));
}

TEST(AtomicFile, NeverReplacesADeviceOrADirectory) {
  const TemporaryDirectory directory;
  EXPECT_THAT(test::messageOf<OutputError>([] { writeFileAtomically("/dev/full", "x"); }),
              HasSubstr("not a regular file"));
  EXPECT_THAT(test::messageOf<OutputError>([&] { writeFileAtomically(directory.path(), "x"); }),
              HasSubstr("is a directory"));
}

TEST(AtomicFile, SaysWhyADirectoryCannotBeUsed) {
  const TemporaryDirectory directory;
  directory.write("file", "");
  EXPECT_THROW(writeFileAtomically(directory / "missing/a", "x"), OutputError);
  EXPECT_THROW(makeWritableDirectory(directory / "file/sub"), OutputError);
  EXPECT_THROW(makeWritableDirectory("/proc/kairos"), OutputError);
  EXPECT_THROW(makeWritableDirectory("/proc"), OutputError);
}

TEST(AtomicFile, CreatesTheDirectoriesAbove) {
  const TemporaryDirectory directory;
  makeWritableDirectory(directory / "a/b/c");
  writeFileAtomically(directory / "a/b/c/d", "x");
  EXPECT_EQ(test::readBytes(directory / "a/b/c/d"), "x");
}

}  // namespace
}  // namespace kairos
