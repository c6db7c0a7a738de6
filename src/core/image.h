// Images: rows top to bottom, interleaved float channels.
#pragma once

#include <cstddef>
#include <vector>

namespace kairos {

/// width x height pixels, row 0 at the top. Pixel (x, y) starts at data[(y * width + x) * channels].
/// Colour images hold premultiplied linear RGBA.
struct Image {
  int width = 0, height = 0, channels = 4;
  std::vector<float> data;

  Image() = default;
  Image(int w, int h, int c) : width(w), height(h), channels(c), data(size_t(w) * size_t(h) * size_t(c)) {}

  float* pixel(int x, int y) {
    return data.data() + (size_t(y) * size_t(width) + size_t(x)) * size_t(channels);
  }
  const float* pixel(int x, int y) const {
    return data.data() + (size_t(y) * size_t(width) + size_t(x)) * size_t(channels);
  }
  bool operator==(const Image&) const = default;
};

}  // namespace kairos
