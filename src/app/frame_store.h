// Images kept for later in a nameless file, so that a long sequence's exact frames need no memory of their
// own.
#pragma once

#include <cstdio>
#include <memory>

#include "core/image.h"

namespace kairos {

/// Images of one size, numbered from 0. Not thread-safe.
class FrameStore {
 public:
  /// Throws OutputError where the system's directory of temporary files cannot be written.
  FrameStore(int width, int height);

  /// Throws OutputError when the disk is full.
  void append(const Image& image);
  size_t count() const { return count_; }
  /// Throws InputError when the file cannot be read.
  const Image& read(size_t index);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void seek(size_t index);

  std::unique_ptr<std::FILE, Close> file_;
  Image image_;  // the one read last
  size_t count_ = 0;
};

}  // namespace kairos
