// Running the built program and looking at what it leaves behind.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace kairos::test {

struct ProgramResult {
  int exitCode = -1;  // 128 + signal where one ended it
  std::string out, err;
};

struct RunOptions {
  std::optional<uint64_t> fileSizeLimit;  // bytes; writing beyond fails as on a full disk
  std::function<void(pid_t)> whileRunning;
};

inline std::string contentsOf(std::FILE* file) {
  std::rewind(file);
  std::string text;
  char buffer[4096];
  while (const size_t n = std::fread(buffer, 1, sizeof buffer, file)) text.append(buffer, n);
  return text;
}

[[noreturn]] inline void becomeProgram(std::vector<char*> argv, int out, int err, const RunOptions& options) {
  if (options.fileSizeLimit) {
    const rlimit limit{*options.fileSizeLimit, *options.fileSizeLimit};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

/// Runs `kairos ARGUMENTS...` to its end.
inline ProgramResult runProgram(const std::vector<std::string>& arguments, const RunOptions& options = {}) {
  std::FILE *out = std::tmpfile(), *err = std::tmpfile();
  if (!out || !err) throw std::runtime_error("no temporary file can be created");
  std::vector<std::string> words{KAIROS_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) becomeProgram(argv, ::fileno(out), ::fileno(err), options);
  if (options.whileRunning) options.whileRunning(child);
  int status = 0;
  ::waitpid(child, &status, 0);
  ProgramResult result{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contentsOf(out),
                       contentsOf(err)};
  std::fclose(out);
  std::fclose(err);
  return result;
}

/// Is `text` exactly one line that starts with "kairos: "?
inline bool isOneErrorLine(const std::string& text) {
  return text.rfind("kairos: ", 0) == 0 && text.back() == '\n' &&
         std::count(text.begin(), text.end(), '\n') == 1;
}

/// A directory of a test's own, removed with everything in it.
class ScratchDirectory {
 public:
  ScratchDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "kairos-test-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary directory can be created");
    path_ = name;
  }
  ~ScratchDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// Names of the files in a directory, sorted; empty when it is not there.
inline std::vector<std::string> fileNames(const std::string& directory) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

inline std::string fileContents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class T>
void writeRawFile(const std::string& path, const std::vector<T>& values) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(T)));
}

}  // namespace kairos::test
