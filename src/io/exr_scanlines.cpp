#include "io/exr_scanlines.h"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>

#include "io/half_rows.h"

namespace kairos {
namespace {

// The quickest that does not merely store; files are smaller than with zlib's levels 1 to 3.
constexpr int kCompressionLevel = 1;

bool isBlank(std::span<const float> values) {
  uint32_t bits = 0;
  for (float value : values) bits |= std::bit_cast<uint32_t>(value);
  return bits == 0;
}

// Encodes chunk after chunk. Kept per thread, so that the frames of an animation are written without asking
// for memory.
class ChunkEncoder {
 public:
  /// The stored bytes of rows [y0, y1], valid until the next call.
  std::span<const char> encode(const std::vector<ExrPlane>& planes, const PixelWindow& rows,
                               bool compressed) {
    gather(planes, rows);
    if (!compressed) return raw_;
    preprocess();
    packed_.resize(raw_.size());
    const size_t size = libdeflate_zlib_compress(compressor(), deltas_.data(), deltas_.size(), packed_.data(),
                                                 packed_.size());
    // Pixels that do not become smaller are stored as they are.
    return size == 0 || size >= raw_.size() ? std::span<const char>(raw_)
                                            : std::span<const char>(packed_.data(), size);
  }

 private:
  // Row by row, and of each row channel by channel.
  void gather(const std::vector<ExrPlane>& planes, const PixelWindow& rows) {
    const auto width = size_t(rows.width());
    size_t rowBytes = 0;
    for (const ExrPlane& plane : planes) rowBytes += width * (plane.half ? sizeof(half) : sizeof(float));
    raw_.resize(rowBytes * size_t(rows.y1 - rows.y0 + 1));
    row_.resize(width);
    halves_.resize(width);
    char* out = raw_.data();
    for (int y = rows.y0; y <= rows.y1; ++y)
      for (const ExrPlane& plane : planes) {
        const float* values = plane.at(rows.x0, y);
        for (size_t x = 0; x < width; ++x) row_[x] = values[x * plane.pixelStride];
        out = plane.half ? appendHalves(out) : append(out, row_.data(), width * sizeof(float));
      }
  }

  char* appendHalves(char* out) {
    toHalves(row_.data(), row_.size(), halves_.data());
    return append(out, halves_.data(), halves_.size() * sizeof(half));
  }

  static char* append(char* out, const void* bytes, size_t count) {
    std::memcpy(out, bytes, count);
    return out + count;
  }

  // Bytes of even and of odd place apart, then each but the first as its difference to the one before, plus
  // 128.
  void preprocess() {
    const size_t size = raw_.size(), half = (size + 1) / 2;
    split_.resize(size);
    deltas_.resize(size);
    const char* raw = raw_.data();
    char *even = split_.data(), *odd = even + half;
    for (size_t i = 0; i < size / 2; ++i) {
      even[i] = raw[2 * i];
      odd[i] = raw[2 * i + 1];
    }
    if (size % 2 != 0) even[half - 1] = raw[size - 1];
    const auto* values = reinterpret_cast<const uint8_t*>(split_.data());
    auto* deltas = reinterpret_cast<uint8_t*>(deltas_.data());
    deltas[0] = values[0];
    for (size_t i = 1; i < size; ++i) deltas[i] = uint8_t(values[i] - values[i - 1] + 128);
  }

  libdeflate_compressor* compressor() {
    if (!compressor_) compressor_.reset(libdeflate_alloc_compressor(kCompressionLevel));
    if (!compressor_) throw std::bad_alloc();
    return compressor_.get();
  }

  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  std::unique_ptr<libdeflate_compressor, Free> compressor_;
  std::vector<char> raw_, split_, deltas_, packed_;
  std::vector<float> row_;
  std::vector<half> halves_;
};
thread_local ChunkEncoder chunkEncoder;

template <class T>
void put(Imf::OStream& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

PixelWindow contentWindow(const std::vector<const Image*>& images) {
  const int width = images.front()->width, height = images.front()->height;
  const auto blank = [&](int x, int y, int count) {
    return std::all_of(images.begin(), images.end(), [&](const Image* image) {
      return isBlank({image->pixel(x, y), size_t(count) * size_t(image->channels)});
    });
  };
  PixelWindow content{width, height, -1, -1};
  for (int y = 0; y < height; ++y) {
    if (blank(0, y, width)) continue;
    content.y0 = std::min(content.y0, y);
    content.y1 = y;
    // Rows reach beyond those above them by little if at all.
    if (!blank(0, y, content.x0)) {
      int x = 0;
      while (blank(x, y, 1)) ++x;
      content.x0 = x;
    }
    if (const int right = content.x1 + 1; !blank(right, y, width - right)) {
      int x = width - 1;
      while (blank(x, y, 1)) --x;
      content.x1 = x;
    }
  }
  return content.y1 < 0 ? PixelWindow{} : content;
}

void writeScanlines(Imf::OStream& out, const std::vector<ExrPlane>& planes, const PixelWindow& window,
                    int rowsPerChunk, bool compressed) {
  const uint64_t table = out.tellp();
  std::vector<uint64_t> offsets(size_t((window.y1 - window.y0) / rowsPerChunk + 1));
  const auto putTable = [&] {
    out.seekp(table);
    out.write(reinterpret_cast<const char*>(offsets.data()), int(offsets.size() * sizeof(uint64_t)));
  };
  putTable();  // takes its place
  for (size_t i = 0; i < offsets.size(); ++i) {
    const int y = window.y0 + int(i) * rowsPerChunk;
    const PixelWindow rows{window.x0, y, window.x1, std::min(y + rowsPerChunk - 1, window.y1)};
    const std::span<const char> chunk = chunkEncoder.encode(planes, rows, compressed);
    offsets[i] = out.tellp();
    put(out, int32_t(y));
    put(out, int32_t(chunk.size()));
    out.write(chunk.data(), int(chunk.size()));
  }
  putTable();
}

}  // namespace kairos
