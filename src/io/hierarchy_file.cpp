#include "io/hierarchy_file.h"

#include <cstring>
#include <filesystem>
#include <span>
#include <string_view>

#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace kairos {
namespace {

constexpr std::string_view kMagic = "KAIROSL1";

struct Header {
  char magic[8];
  uint64_t identity, values, statistics;
};

template <class T>
void append(std::string& bytes, const T* data, size_t count) {
  bytes.append(reinterpret_cast<const char*>(data), count * sizeof(T));
}

}  // namespace

// Little-endian: header, values, statistics, XXH64 of all before.
void writeHierarchy(const std::string& path, uint64_t identity, const StoredHierarchy& hierarchy) {
  Header header{{}, identity, hierarchy.values.size(), hierarchy.statistics.size()};
  std::memcpy(header.magic, kMagic.data(), kMagic.size());
  std::string bytes;
  bytes.reserve(sizeof header + header.values * sizeof(float) + header.statistics * sizeof(double) + 8);
  append(bytes, &header, 1);
  append(bytes, hierarchy.values.data(), hierarchy.values.size());
  append(bytes, hierarchy.statistics.data(), hierarchy.statistics.size());
  const uint64_t checksum = xxh64(bytes);
  append(bytes, &checksum, 1);
  writeFileAtomically(path, bytes);
}

std::optional<StoredHierarchy> readHierarchy(const std::string& path, uint64_t identity) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return {};
  std::vector<char> bytes;
  try {
    bytes = InputFile(path).readAll();
  } catch (const InputError&) {
    return {};
  }
  Header header;
  uint64_t checksum;
  if (bytes.size() < sizeof header + sizeof checksum) return {};
  std::memcpy(&header, bytes.data(), sizeof header);
  const uint64_t payload = bytes.size() - sizeof header - sizeof checksum;
  const auto whole = std::span(bytes).first(bytes.size() - sizeof checksum);
  std::memcpy(&checksum, bytes.data() + whole.size(), sizeof checksum);
  if (std::string_view(header.magic, sizeof header.magic) != kMagic || header.identity != identity ||
      header.values > payload / sizeof(float) || header.statistics > payload / sizeof(double) ||
      header.values * sizeof(float) + header.statistics * sizeof(double) != payload ||
      xxh64(whole) != checksum)
    return {};
  StoredHierarchy hierarchy;
  hierarchy.values.resize(header.values);
  hierarchy.statistics.resize(header.statistics);
  const char* from = bytes.data() + sizeof header;
  const auto take = [&from](auto& numbers) {
    if (numbers.empty()) return;  // whose data() may be null
    const size_t size = numbers.size() * sizeof numbers[0];
    std::memcpy(numbers.data(), from, size);
    from += size;
  };
  take(hierarchy.values);
  take(hierarchy.statistics);
  return hierarchy;
}

}  // namespace kairos
