#include "io/file_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace kairos {
namespace {

static_assert(std::endian::native == std::endian::little,
              "files are read as little-endian without conversion");

constexpr uint64_t kPrime1 = 0x9e3779b185ebca87ull, kPrime2 = 0xc2b2ae3d27d4eb4full,
                   kPrime3 = 0x165667b19e3779f9ull, kPrime4 = 0x85ebca77c2b2ae63ull,
                   kPrime5 = 0x27d4eb2f165667c5ull;

template <class T>
T load(const char* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));
  return value;
}

uint64_t xxhRound(uint64_t lane, uint64_t input) {
  return std::rotl(lane + input * kPrime2, 31) * kPrime1;
}

uint64_t xxhMerge(uint64_t hash, uint64_t lane) {
  return (hash ^ xxhRound(0, lane)) * kPrime1 + kPrime4;
}

// The 32-byte stripes of the input; advances `p`.
uint64_t xxhStripes(const char*& p, const char* end) {
  uint64_t a = kPrime1 + kPrime2, b = kPrime2, c = 0, d = 0 - kPrime1;
  for (; end - p >= 32; p += 32) {
    a = xxhRound(a, load<uint64_t>(p));
    b = xxhRound(b, load<uint64_t>(p + 8));
    c = xxhRound(c, load<uint64_t>(p + 16));
    d = xxhRound(d, load<uint64_t>(p + 24));
  }
  uint64_t hash = std::rotl(a, 1) + std::rotl(b, 7) + std::rotl(c, 12) + std::rotl(d, 18);
  for (uint64_t lane : {a, b, c, d}) hash = xxhMerge(hash, lane);
  return hash;
}

}  // namespace

uint64_t xxh64(std::span<const char> bytes) {
  const char* p = bytes.data();
  const char* const end = p + bytes.size();
  uint64_t hash = (bytes.size() >= 32 ? xxhStripes(p, end) : kPrime5) + bytes.size();
  for (; end - p >= 8; p += 8)
    hash = std::rotl(hash ^ xxhRound(0, load<uint64_t>(p)), 27) * kPrime1 + kPrime4;
  if (end - p >= 4) {
    hash = std::rotl(hash ^ load<uint32_t>(p) * kPrime1, 23) * kPrime2 + kPrime3;
    p += 4;
  }
  for (; p < end; ++p) hash = std::rotl(hash ^ uint8_t(*p) * kPrime5, 11) * kPrime1;
  hash = (hash ^ (hash >> 33)) * kPrime2;
  hash = (hash ^ (hash >> 29)) * kPrime3;
  return hash ^ (hash >> 32);
}

std::string hexOf(uint64_t value) {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
  return digits;
}

uint64_t valueOfHex(const std::string& digits) {
  if (digits.size() != 16 || digits.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw std::invalid_argument("expected 16 hexadecimal digits");
  return std::stoull(digits, nullptr, 16);
}

InputFile::InputFile(const std::string& path)
    : path_(path), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw InputError(path, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat status;
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw InputError(path, "is not a regular file");
  }
  size_ = uint64_t(status.st_size);
}

InputFile::~InputFile() {
  ::close(descriptor_);
}

void InputFile::readAt(uint64_t offset, char* to, size_t bytes) const {
  while (bytes > 0) {
    const ssize_t n = ::pread(descriptor_, to, std::min(bytes, size_t(1) << 30), off_t(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw InputError(path_, std::string("cannot be read: ") + std::strerror(errno));
    if (n == 0)
      throw InputError(path_, "ends at byte " + std::to_string(offset) + ", expected " +
                                  std::to_string(bytes) + " more (truncated?)");
    to += n;
    offset += uint64_t(n);
    bytes -= size_t(n);
  }
}

ByteBuffer InputFile::read(uint64_t offset, size_t bytes) const {
  ByteBuffer buffer(bytes);
  readAt(offset, buffer.data(), bytes);
  return buffer;
}

std::vector<char> InputFile::readAll() const {
  std::vector<char> bytes(size_);
  readAt(0, bytes.data(), bytes.size());
  return bytes;
}

void ByteReader::require(uint64_t bytes) const {
  if (bytes > remaining())
    fail("is damaged or truncated: " + std::to_string(bytes) + " bytes expected at byte " +
         std::to_string(position_) + ", found " + std::to_string(remaining()));
}

void ByteReader::seek(uint64_t position) {
  if (position > end_ || (!file_ && position < windowBegin_))
    fail("is damaged or truncated: it refers to byte " + std::to_string(position) + " of " +
         std::to_string(end_));
  position_ = position;
}

void ByteReader::skip(uint64_t bytes) {
  require(bytes);
  position_ += bytes;
}

void ByteReader::refill() {
  constexpr uint64_t kWindow = 1 << 16;
  buffer_.resize(size_t(std::min(kWindow, remaining())));
  file_->readAt(position_, buffer_.data(), buffer_.size());
  window_ = buffer_;
  windowBegin_ = position_;
}

void ByteReader::read(char* to, size_t bytes) {
  require(bytes);
  while (bytes > 0) {
    if (position_ < windowBegin_ || position_ >= windowBegin_ + window_.size()) refill();
    const size_t from = size_t(position_ - windowBegin_), n = std::min(bytes, window_.size() - from);
    std::memcpy(to, window_.data() + from, n);
    to += n;
    bytes -= n;
    position_ += n;
  }
}

std::string ByteReader::getString(size_t limit) {
  const auto length = get<uint32_t>();
  if (length > limit)
    fail("is damaged: a text of " + std::to_string(length) + " bytes at byte " + std::to_string(position_));
  std::string text(length, '\0');
  read(text.data(), length);
  return text;
}

}  // namespace kairos
