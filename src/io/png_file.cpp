#include "io/png_file.h"

#include <png.h>

#include <array>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/srgb.h"

namespace kairos {
namespace {

// The 8-bit sRGB code of a linear value in 65536 steps: within 0.56 of a code of the exact curve at its
// steepest.
const std::array<uint8_t, 65536>& srgbCodes() {
  static const std::array<uint8_t, 65536> codes = [] {
    std::array<uint8_t, 65536> table{};
    for (size_t i = 0; i < table.size(); ++i)
      table[i] = uint8_t(std::lround(255 * srgbFromLinear(double(i) / 65535)));
    return table;
  }();
  return codes;
}

}  // namespace

std::vector<char> encodePng(const std::string& path, const Image& rgba) {
  if (rgba.width <= 0 || rgba.height <= 0 || rgba.channels < 3)
    throw OutputError(path, "an image of " + std::to_string(rgba.width) + " x " +
                                std::to_string(rgba.height) + " x " + std::to_string(rgba.channels) +
                                " cannot be written as PNG");
  const auto& codes = srgbCodes();
  std::vector<uint8_t> pixels(size_t(rgba.width) * size_t(rgba.height) * 3);
  uint8_t* out = pixels.data();
  for (size_t p = 0; p < rgba.data.size(); p += size_t(rgba.channels))
    for (size_t c = 0; c < 3; ++c) *out++ = codes[size_t(65535 * displayed(rgba.data[p + c]) + 0.5)];
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(rgba.width);
  image.height = png_uint_32(rgba.height);
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<char> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw OutputError(path, std::string("cannot be encoded as PNG: ") + image.message);
  bytes.resize(size);
  return bytes;
}

Image decodePng(const std::string& path, std::span<const char> bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()))
    throw InputError(path, std::string("is no PNG image that can be read: ") + image.message);
  constexpr png_uint_32 kLargest = 1 << 16;
  if (image.width > kLargest || image.height > kLargest) {
    png_image_free(&image);
    throw InputError(path, "is not a flat image of at most 65536 x 65536 pixels");
  }
  // Deflate packs a byte into 1/1032 of one at most, and a byte holds eight pixels at most.
  constexpr uint64_t kPixelsPerByte = 1032 * 8;
  if (uint64_t(image.width) * image.height > kPixelsPerByte * bytes.size()) {
    png_image_free(&image);
    throw InputError(path, "claims more pixels than its bytes can hold");
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<uint8_t> pixels(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr))
    throw InputError(path, std::string("cannot be read: ") + image.message);
  Image result(int(image.width), int(image.height), 4);
  for (size_t p = 0; p < pixels.size(); p += 4) {
    // PNG holds unassociated sRGB.
    const double alpha = pixels[p + 3] / 255.0;
    for (size_t c = 0; c < 3; ++c) result.data[p + c] = float(linearFromSrgb(pixels[p + c] / 255.0) * alpha);
    result.data[p + 3] = float(alpha);
  }
  return result;
}

}  // namespace kairos
