// Reading files as bytes, every access checked against the file's end.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"

namespace kairos {

/// XXH64 with seed 0 (Collet): the checksum of whole files in sequence.json.
uint64_t xxh64(std::span<const char> bytes);
/// 16 lower-case hexadecimal digits, and back. Throws std::invalid_argument.
std::string hexOf(uint64_t value);
uint64_t valueOfHex(const std::string& digits);

/// Memory for bytes about to be read, which is not cleared first.
class ByteBuffer {
 public:
  explicit ByteBuffer(size_t size) : data_(std::make_unique_for_overwrite<char[]>(size)), size_(size) {}
  char* data() { return data_.get(); }
  size_t size() const { return size_; }
  operator std::span<const char>() const { return {data_.get(), size_}; }

 private:
  std::unique_ptr<char[]> data_;
  size_t size_;
};

/// A regular file open for reading. Safe to use from several threads.
class InputFile {
 public:
  /// Throws InputError when the file is missing, unreadable or not a regular file.
  explicit InputFile(const std::string& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::string& path() const { return path_; }
  uint64_t size() const { return size_; }
  /// Throws InputError when the file ends before `offset + bytes`.
  void readAt(uint64_t offset, char* to, size_t bytes) const;
  ByteBuffer read(uint64_t offset, size_t bytes) const;
  std::vector<char> readAll() const;

 private:
  std::string path_;
  int descriptor_;
  uint64_t size_ = 0;
};

/// Parses little-endian values one after the other, from a file (buffered) or from memory. Throws InputError
/// where the data end too early. Positions are absolute: byte 0 is the start of the file.
class ByteReader {
 public:
  /// Reads bytes [0, file.size()); `file` must outlive the reader.
  explicit ByteReader(const InputFile& file) : path_(file.path()), file_(&file), end_(file.size()) {}
  /// Reads `bytes`, which stand at `offset` of the file `path`; they must outlive the reader.
  ByteReader(std::string path, std::span<const char> bytes, uint64_t offset = 0)
      : path_(std::move(path)),
        window_(bytes),
        windowBegin_(offset),
        position_(offset),
        end_(offset + bytes.size()) {}

  const std::string& path() const { return path_; }
  uint64_t position() const { return position_; }
  uint64_t remaining() const { return end_ - position_; }
  void seek(uint64_t position);
  void skip(uint64_t bytes);
  void read(char* to, size_t bytes);

  template <class T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    read(reinterpret_cast<char*>(&value), sizeof(T));
    return value;
  }
  /// A 32-bit length and that many bytes, `limit` at most.
  std::string getString(size_t limit = 1 << 20);

  [[noreturn]] void fail(const std::string& problem) const { throw InputError(path_, problem); }

 private:
  void require(uint64_t bytes) const;
  void refill();

  std::string path_;
  const InputFile* file_ = nullptr;
  std::vector<char> buffer_;
  std::span<const char> window_;
  uint64_t windowBegin_ = 0, position_ = 0, end_ = 0;
};

}  // namespace kairos
