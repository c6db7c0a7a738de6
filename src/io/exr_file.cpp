// Writing EXR: headers and PIZ by OpenEXR, other pixels by exr_scanlines.h. The file is made in memory first:
// OpenEXR's own file stream reports a full disk only for part of its writes.
#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string_view>

#include "core/error.h"
#include "io/atomic_file.h"
#include "io/exr_scanlines.h"
#include "io/half_rows.h"
#include "io/image_file.h"

namespace kairos {
namespace {

// Writes into `storage`, which only ever grows.
class MemoryStream : public Imf::OStream {
 public:
  explicit MemoryStream(std::vector<char>& storage) : OStream("memory"), storage_(storage) {}
  void write(const char data[], int count) override {
    const size_t end = position_ + size_t(count);
    if (storage_.size() < end) storage_.resize(std::max(end, 2 * storage_.size()));
    std::memcpy(storage_.data() + position_, data, size_t(count));
    position_ = end;
    size_ = std::max(size_, end);
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }
  std::string_view bytes() const { return {storage_.data(), size_}; }

 private:
  std::vector<char>& storage_;
  size_t position_ = 0, size_ = 0;
};

// What encoding an image needs. Kept per thread, so that the frames of an animation are written without
// asking for memory: fresh pages cost more than filling them.
struct EncodingMemory {
  std::vector<half> halves;
  std::vector<char> file;
};
thread_local EncodingMemory encodingMemory;

Imf::Compression compressionOf(ExrCompression c) {
  switch (c) {
    case ExrCompression::none:
      return Imf::NO_COMPRESSION;
    case ExrCompression::zips:
      return Imf::ZIPS_COMPRESSION;
    case ExrCompression::piz:
      return Imf::PIZ_COMPRESSION;
    default:
      return Imf::ZIP_COMPRESSION;
  }
}

// OpenEXR's camera space is left-handed: x right, y up, and z > 0 in front of the camera. Points are row
// vectors.
Imath::M44d worldToCameraOf(const Camera& camera, int width, int height) {
  const RayGenerator rays(camera, width, height);
  const Vec3d x = rays.right(), y = rays.up(), z = rays.forward(), e = camera.eye;
  return {x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, -dot(e, x), -dot(e, y), -dot(e, z), 1};
}

// From camera space to (0, 0) at the upper left and (1, 1) at the lower right corner of the image, after
// division by w.
Imath::M44d cameraToNdcOf(const Camera& camera, int width, int height) {
  const bool perspective = camera.projection == Camera::Projection::perspective;
  const double imageHeight =
      perspective ? 2 * std::tan(camera.verticalFovDegrees * std::numbers::pi / 360) : camera.imageHeight;
  const double sx = height / (imageHeight * width), sy = -1 / imageHeight;
  if (perspective) return {sx, 0, 0, 0, 0, sy, 0, 0, 0.5, 0.5, 1, 1, 0, 0, 0, 0};
  return {sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 0, 1};
}

void addMetadata(Imf::Header& header, const Metadata& metadata) {
  for (const auto& [name, value] : metadata) {
    if (const auto* s = std::get_if<std::string>(&value)) header.insert(name, Imf::StringAttribute(*s));
    if (const auto* i = std::get_if<int>(&value)) header.insert(name, Imf::IntAttribute(*i));
    if (const auto* f = std::get_if<float>(&value)) header.insert(name, Imf::FloatAttribute(*f));
    if (const auto* d = std::get_if<double>(&value)) header.insert(name, Imf::DoubleAttribute(*d));
  }
}

// The data window leaves out the blank margin, which a sparse volume's image mostly is.
Imf::Header headerOf(const Image& rgba, const std::vector<ExrPlane>& planes, const PixelWindow& content,
                     const Camera& camera, const Metadata& metadata, const ExrOptions& options) {
  Imf::Header header(rgba.width, rgba.height);
  header.dataWindow() = {{content.x0, content.y0}, {content.x1, content.y1}};
  header.compression() = compressionOf(options.compression);
  for (const ExrPlane& plane : planes)
    header.channels().insert(plane.name, Imf::Channel(plane.half ? Imf::HALF : Imf::FLOAT));
  const Imath::M44d worldToCamera = worldToCameraOf(camera, rgba.width, rgba.height);
  Imf::addWorldToCamera(header, Imath::M44f(worldToCamera));
  Imf::addWorldToNDC(header, Imath::M44f(worldToCamera * cameraToNdcOf(camera, rgba.width, rgba.height)));
  Imf::addFramesPerSecond(header, Imf::guessExactFps(options.framesPerSecond));
  addMetadata(header, metadata);
  return header;
}

void requireShape(const std::string& path, const Image& image, int width, int height, int channels) {
  if (image.width <= 0 || image.height <= 0 || image.width != width || image.height != height ||
      image.channels < channels ||
      image.data.size() != size_t(width) * size_t(height) * size_t(image.channels))
    throw OutputError(path, "an image of " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " x " + std::to_string(image.channels) +
                                " cannot be written as one of " + std::to_string(width) + " x " +
                                std::to_string(height) + " with " + std::to_string(channels) + " channels");
}

// Of the colour and the further channels, in the order of their names, which is that of the file.
std::vector<ExrPlane> planesOf(const Image& rgba, const std::vector<ExrChannel>& channels, bool half) {
  const auto plane = [](const std::string& name, const Image& image, int channel, bool asHalf) {
    const auto stride = size_t(image.channels);
    return ExrPlane{name, image.data.data() + channel, stride, stride * size_t(image.width), asHalf};
  };
  std::vector<ExrPlane> planes;
  static const char* const kNames[] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c) planes.push_back(plane(kNames[c], rgba, c, half));
  for (const ExrChannel& channel : channels) planes.push_back(plane(channel.name, *channel.image, 0, false));
  std::sort(planes.begin(), planes.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return planes;
}

void encodeByLibrary(MemoryStream& stream, const Image& rgba, const std::vector<ExrPlane>& planes,
                     const Imf::Header& header) {
  std::vector<half>& halves = encodingMemory.halves;
  halves.resize(rgba.data.size());
  toHalves(rgba.data.data(), rgba.data.size(), halves.data());
  Imf::FrameBuffer frame;
  for (const ExrPlane& p : planes) {
    const size_t value = p.half ? sizeof(half) : sizeof(float);
    const void* first = p.half ? static_cast<const void*>(halves.data() + (p.first - rgba.data.data()))
                               : static_cast<const void*>(p.first);
    frame.insert(p.name, Imf::Slice(p.half ? Imf::HALF : Imf::FLOAT,
                                    static_cast<char*>(const_cast<void*>(first)),  // only read from
                                    p.pixelStride * value, p.rowStride * value));
  }
  Imf::OutputFile file(stream, header, 0);
  file.setFrameBuffer(frame);
  file.writePixels(header.dataWindow().max.y - header.dataWindow().min.y + 1);
}

void writeHeader(MemoryStream& stream, const Imf::Header& header) {
  constexpr size_t kShortName = 31;
  uint32_t version[] = {Imf::MAGIC, Imf::EXR_VERSION};
  for (auto it = header.begin(); it != header.end(); ++it)
    if (std::strlen(it.name()) > kShortName) version[1] |= Imf::LONG_NAMES_FLAG;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
    if (std::strlen(it.name()) > kShortName) version[1] |= Imf::LONG_NAMES_FLAG;
  stream.write(reinterpret_cast<const char*>(version), sizeof version);
  header.writeTo(stream);
}

void encode(MemoryStream& stream, const Image& rgba, const std::vector<ExrPlane>& planes,
            const Imf::Header& header, ExrCompression compression) {
  if (compression == ExrCompression::piz) return encodeByLibrary(stream, rgba, planes, header);
  writeHeader(stream, header);
  const Imath::Box2i& window = header.dataWindow();
  constexpr int kZipRows = 16;
  writeScanlines(stream, planes, {window.min.x, window.min.y, window.max.x, window.max.y},
                 compression == ExrCompression::zip ? kZipRows : 1, compression != ExrCompression::none);
}

}  // namespace

void writeExr(const std::string& path, const Image& rgba, const std::vector<ExrChannel>& channels,
              const Camera& camera, const Metadata& metadata, const ExrOptions& options) {
  requireShape(path, rgba, rgba.width, rgba.height, 4);
  if (rgba.channels != 4) requireShape(path, rgba, rgba.width, rgba.height, rgba.channels + 1);
  for (const ExrChannel& channel : channels) requireShape(path, *channel.image, rgba.width, rgba.height, 1);
  MemoryStream stream(encodingMemory.file);
  try {
    const std::vector<ExrPlane> planes = planesOf(rgba, channels, options.half);
    std::vector<const Image*> images{&rgba};
    for (const ExrChannel& channel : channels) images.push_back(channel.image);
    const Imf::Header header = headerOf(rgba, planes, contentWindow(images), camera, metadata, options);
    encode(stream, rgba, planes, header, options.compression);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw OutputError(path, std::string("cannot be encoded as EXR: ") + e.what());
  }
  writeFileAtomically(path, stream.bytes());
}

}  // namespace kairos
