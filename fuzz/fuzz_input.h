// What the fuzz targets share: bytes as a file, and which ends of a reader are its promise.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/error.h"

namespace kairos::fuzz {

/// This process's own directory, in memory where the system has such a place; removed at exit.
class ScratchDirectory {
 public:
  ScratchDirectory()
      : path_((std::filesystem::is_directory("/dev/shm") ? std::filesystem::path("/dev/shm")
                                                         : std::filesystem::temp_directory_path()) /
              ("kairos-fuzz-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchDirectory() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;

  const std::string path() const { return path_.string(); }
  std::string write(const char* name, std::string_view bytes) const {
    const std::string file = (path_ / name).string();
    std::ofstream(file, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), std::streamsize(bytes.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

inline std::string_view textOf(const uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Reads; damaged bytes may be refused with the errors the readers promise. Any other end is a finding.
template <class Read>
int readOrRefused(Read&& read) {
  try {
    read();
  } catch (const InputError&) {
  } catch (const StateError&) {
  }
  return 0;
}

}  // namespace kairos::fuzz
