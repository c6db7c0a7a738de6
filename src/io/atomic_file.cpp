#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "core/error.h"

namespace kairos {
namespace {

// A file under its temporary name, removed unless it is renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& path)
      : path_(path), temporary_(path + ".tmp-" + std::to_string(::getpid())) {
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) fail("cannot be created");
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!renamed_) ::unlink(temporary_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), std::min(bytes.size(), size_t(1) << 30));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) fail("cannot be written");
      bytes.remove_prefix(size_t(written));
    }
  }

  void rename() {
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail("cannot be written");
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot be renamed to its final name");
    renamed_ = true;
  }

 private:
  // The destructor does not run when the constructor throws, but then there is no file either.
  [[noreturn]] void fail(const char* what) const {
    throw OutputError(path_, std::string(what) + ": " + std::strerror(errno));
  }

  std::string path_, temporary_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

// Renaming over a device or a pipe would replace it.
void requireRegularOrAbsent(const std::string& path) {
  struct stat status;
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    throw OutputError(path, S_ISDIR(status.st_mode) ? "is a directory, expected a file name"
                                                    : "exists and is not a regular file");
}

}  // namespace

void writeFileAtomically(const std::string& path, std::string_view bytes) {
  requireRegularOrAbsent(path);
  TemporaryFile file(path);
  file.write(bytes);
  file.rename();
}

void makeWritableDirectory(const std::string& directory) {
  const std::string name = directory.empty() ? "." : directory;
  std::error_code error;
  std::filesystem::create_directories(name, error);
  if (!std::filesystem::is_directory(name))
    throw OutputError(name, "cannot be created as a directory: " +
                                (error ? error.message() : std::string("something else has this name")));
  const std::string probe = name + "/.kairos-probe";
  try {
    TemporaryFile file(probe);
  } catch (const OutputError&) {
    throw OutputError(name, std::string("no file can be created in this directory: ") + std::strerror(errno));
  }
}

}  // namespace kairos
