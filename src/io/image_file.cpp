// Which format an image file has, by its first bytes.
#include "io/image_file.h"

#include <cstring>

#include "core/error.h"
#include "io/atomic_file.h"
#include "io/exr_reader.h"
#include "io/file_bytes.h"
#include "io/png_file.h"

namespace kairos {
namespace {

bool startsWith(const std::vector<char>& bytes, const char* magic, size_t length) {
  return bytes.size() >= length && std::memcmp(bytes.data(), magic, length) == 0;
}
bool isExr(const std::vector<char>& bytes) {
  return startsWith(bytes, "\x76\x2f\x31\x01", 4);
}
bool isPng(const std::vector<char>& bytes) {
  return startsWith(bytes, "\x89PNG\r\n\x1a\n", 8);
}

}  // namespace

Image readImage(const std::string& path) {
  const std::vector<char> bytes = InputFile(path).readAll();
  if (isExr(bytes)) return readExr(path, bytes);
  if (isPng(bytes)) return decodePng(path, bytes);
  throw InputError(path, "is no image that can be read: expected an EXR or a PNG file");
}

Metadata readMetadata(const std::string& path) {
  const std::vector<char> bytes = InputFile(path).readAll();
  if (isExr(bytes)) return readExrMetadata(path, bytes);
  throw InputError(path, "holds no metadata: expected an EXR file");
}

void writePng(const std::string& path, const Image& rgba) {
  const std::vector<char> bytes = encodePng(path, rgba);
  writeFileAtomically(path, {bytes.data(), bytes.size()});
}

}  // namespace kairos
