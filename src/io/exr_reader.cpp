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

#include <cstring>

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

Image readPixels(const std::string& path, std::span<const char> bytes) {
  MemoryInput stream(bytes);
  Imf::InputFile file(stream, 0);
  const Imath::Box2i window = file.header().dataWindow();
  const int64_t width = int64_t(window.max.x) - window.min.x + 1,
                height = int64_t(window.max.y) - window.min.y + 1;
  if (width < 1 || height < 1 || width > kLargest || height > kLargest)
    throw InputError(path, "is not a flat image of at most 65536 x 65536 pixels");
  // A header that claims far more than the most compressible image would cost memory before it fails.
  constexpr int64_t kPixelsPerByte = 100'000;
  if (width * height > kPixelsPerByte * int64_t(bytes.size()))
    throw InputError(path, "claims more pixels than its bytes can hold");
  const Imf::ChannelList& channels = file.header().channels();
  const bool colour = channels.findChannel("R") && channels.findChannel("G") && channels.findChannel("B");
  if (!colour && !channels.findChannel("Y")) throw InputError(path, "has no channels R, G, B or Y");
  Image image(int(width), int(height), 4);
  Imf::FrameBuffer frame;
  const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c) {
    if (!colour && c < 3 && c > 0) continue;
    const size_t pixel = 4 * sizeof(float), row = pixel * size_t(width);
    char* first = reinterpret_cast<char*>(image.data.data() + c);
    // OpenEXR addresses by absolute coordinates.
    char* base =
        first - ptrdiff_t(window.min.x) * ptrdiff_t(pixel) - ptrdiff_t(window.min.y) * ptrdiff_t(row);
    frame.insert(!colour && c == 0 ? "Y" : names[c],
                 Imf::Slice(Imf::FLOAT, base, pixel, row, 1, 1, c == 3 ? 1.0 : 0.0));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  if (!colour)
    for (size_t p = 0; p < image.data.size(); p += 4) image.data[p + 1] = image.data[p + 2] = image.data[p];
  return image;
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
