#include "io/atomic_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "core/error.h"

namespace kairos {
namespace {

constexpr std::string_view kTemporary = ".tmp-", kProbe = ".kairos-probe";

// A file under its temporary name, removed unless it is renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& path)
      : path_(path), temporary_(path + std::string(kTemporary) + std::to_string(::getpid())) {
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

// The process that `name` of a temporary file tells of; 0 when it is none of ours.
pid_t writerOf(const std::string& name) {
  const size_t at = name.rfind(kTemporary);
  if (at == std::string::npos) return 0;
  const std::string digits = name.substr(at + kTemporary.size()), target = name.substr(0, at);
  constexpr size_t kMostDigits = 9;
  if (digits.empty() || digits.size() > kMostDigits ||
      digits.find_first_not_of("0123456789") != std::string::npos)
    return 0;
  const std::array<std::string_view, 8> endings = {".exr", ".png",  ".vdb",    ".json",
                                                   ".csv", ".html", ".levels", kProbe};
  const bool ours =
      std::any_of(endings.begin(), endings.end(), [&](std::string_view e) { return target.ends_with(e); });
  return ours ? pid_t(std::stol(digits)) : 0;
}

// Its process is gone, or runs on another machine, where nothing was written for a while.
bool isAbandoned(const std::filesystem::directory_entry& entry) {
  constexpr std::chrono::seconds kWhile(10);
  const pid_t writer = writerOf(entry.path().filename().string());
  if (writer <= 0 || ::kill(writer, 0) == 0 || errno != ESRCH) return false;
  std::error_code error;
  const auto written = entry.last_write_time(error);
  return !error && std::filesystem::file_time_type::clock::now() - written > kWhile;
}

// What killed processes left behind; nothing else would ever remove it.
void removeAbandonedFiles(const std::string& directory) {
  std::error_code error;
  std::filesystem::directory_iterator entry(directory, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    if (isAbandoned(*entry)) std::filesystem::remove(entry->path(), ignored);
  }
}

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
  const std::string probe = name + "/" + std::string(kProbe);
  try {
    TemporaryFile file(probe);
  } catch (const OutputError&) {
    throw OutputError(name, std::string("no file can be created in this directory: ") + std::strerror(errno));
  }
  removeAbandonedFiles(name);
}

}  // namespace kairos
