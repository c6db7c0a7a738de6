// Reading EXR through OpenEXR, from memory.
#include "io/exr_reader.h"

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/error.h"
#include "io/exr_header_check.h"

namespace kairos {
namespace {

constexpr int kLargest = 1 << 16;

class MemoryInput : public Imf::IStream {
 public:
  explicit MemoryInput(std::span<const char> bytes) : IStream("memory"), bytes_(bytes) {}
  bool read(char out[], int count) override {
    const auto n = size_t(count);
    if (n > bytes_.size() - position_) throw std::runtime_error("it ends too early");
    std::memcpy(out, bytes_.data() + position_, n);
    position_ += n;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("it points beyond its end");
    position_ = size_t(position);
  }

 private:
  std::span<const char> bytes_;
  size_t position_ = 0;
};

// OpenEXR throws what it finds wrong as exceptions of several kinds.
template <class Read>
auto guarded(const std::string& path, Read&& read) {
  try {
    return read();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw InputError(path, "needs more memory than there is");
  } catch (const std::exception& e) {
    throw InputError(path, std::string("is no EXR image that can be read: ") + e.what());
  }
}

struct Window {
  int64_t x0, y0, width, height;
};

Window checkedWindow(const std::string& path, const Imath::Box2i& box, size_t bytes) {
  const Window w{box.min.x, box.min.y, int64_t(box.max.x) - box.min.x + 1,
                 int64_t(box.max.y) - box.min.y + 1};
  if (w.width < 1 || w.height < 1 || w.width > kLargest || w.height > kLargest)
    throw InputError(path, "is not a flat image of at most 65536 x 65536 pixels");
  // A header that claims far more than the most compressible image would cost memory before it fails.
  constexpr int64_t kPixelsPerByte = 100'000;
  if (w.width * w.height > kPixelsPerByte * int64_t(bytes))
    throw InputError(path, "claims more pixels than its bytes can hold");
  return w;
}

// The part of `data`, an image of the data window, that shows in the display window; 0 around it.
Image displayed(Image data, const Window& from, const Window& to) {
  if (from.x0 == to.x0 && from.y0 == to.y0 && from.width == to.width && from.height == to.height) return data;
  Image image(int(to.width), int(to.height), 4);
  const int64_t x0 = std::max(from.x0, to.x0), x1 = std::min(from.x0 + from.width, to.x0 + to.width);
  const int64_t y0 = std::max(from.y0, to.y0), y1 = std::min(from.y0 + from.height, to.y0 + to.height);
  for (int64_t y = y0; y < y1 && x0 < x1; ++y) {
    const float* row = data.pixel(int(x0 - from.x0), int(y - from.y0));
    std::copy_n(row, 4 * (x1 - x0), image.pixel(int(x0 - to.x0), int(y - to.y0)));
  }
  return image;
}

Image readPixels(const std::string& path, std::span<const char> bytes) {
  MemoryInput stream(bytes);
  Imf::InputFile file(stream, 0);
  const Window window = checkedWindow(path, file.header().dataWindow(), bytes.size());
  const Window display = checkedWindow(path, file.header().displayWindow(), bytes.size());
  const Imf::ChannelList& channels = file.header().channels();
  const bool colour = channels.findChannel("R") && channels.findChannel("G") && channels.findChannel("B");
  if (!colour && !channels.findChannel("Y")) throw InputError(path, "has no channels R, G, B or Y");
  Image image(int(window.width), int(window.height), 4);
  Imf::FrameBuffer frame;
  const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c) {
    if (!colour && c < 3 && c > 0) continue;
    const size_t pixel = 4 * sizeof(float), row = pixel * size_t(window.width);
    char* first = reinterpret_cast<char*>(image.data.data() + c);
    // OpenEXR addresses by absolute coordinates.
    char* base = first - ptrdiff_t(window.x0) * ptrdiff_t(pixel) - ptrdiff_t(window.y0) * ptrdiff_t(row);
    frame.insert(!colour && c == 0 ? "Y" : names[c],
                 Imf::Slice(Imf::FLOAT, base, pixel, row, 1, 1, c == 3 ? 1.0 : 0.0));
  }
  file.setFrameBuffer(frame);
  file.readPixels(int(window.y0), int(window.y0 + window.height - 1));
  if (!colour)
    for (size_t p = 0; p < image.data.size(); p += 4) image.data[p + 1] = image.data[p + 2] = image.data[p];
  return displayed(std::move(image), window, display);
}

Metadata readAttributes(std::span<const char> bytes) {
  MemoryInput stream(bytes);
  const Imf::InputFile file(stream, 0);
  Metadata metadata;
  for (auto it = file.header().begin(); it != file.header().end(); ++it) {
    const Imf::Attribute& attribute = it.attribute();
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&attribute))
      metadata[it.name()] = s->value();
    if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(&attribute)) metadata[it.name()] = i->value();
    if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
      metadata[it.name()] = f->value();
    if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(&attribute))
      metadata[it.name()] = d->value();
  }
  return metadata;
}

}  // namespace

Image readExr(const std::string& path, std::span<const char> bytes) {
  checkExrHeader(path, bytes);
  return guarded(path, [&] { return readPixels(path, bytes); });
}

Metadata readExrMetadata(const std::string& path, std::span<const char> bytes) {
  checkExrHeader(path, bytes);
  return guarded(path, [&] { return readAttributes(bytes); });
}

}  // namespace kairos
