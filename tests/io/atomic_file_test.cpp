#include "io/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>

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

pid_t endedProcess() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  return child;
}

TEST(AtomicFile, WhatKilledProcessesLeftIsRemovedOnceItIsOld) {
  const TemporaryDirectory directory;
  const auto left = [&](const std::string& name, int secondsAgo) {
    const std::string path = directory.write(name, "half");
    std::filesystem::last_write_time(
        path, std::filesystem::file_time_type::clock::now() - std::chrono::seconds(secondsAgo));
  };
  const std::string ended = ".tmp-" + std::to_string(endedProcess());
  left("f.0001.exr" + ended, 60);
  left(".kairos-probe" + ended, 60);
  left("f.0002.exr" + ended, 0);                             // might be another machine's
  left("f.0003.exr.tmp-" + std::to_string(::getpid()), 60);  // its process lives
  left("notes" + ended, 60);                                 // not ours
  left("f.0004.exr.tmp-", 60);
  makeWritableDirectory(directory.path());
  EXPECT_THAT(directory.names(), testing::UnorderedElementsAre("f.0002.exr" + ended,
                                                               "f.0003.exr.tmp-" + std::to_string(::getpid()),
                                                               "notes" + ended, "f.0004.exr.tmp-"));
}

}  // namespace
}  // namespace kairos
