// The layout is that of "OpenEXR File Layout" (openexr.com): magic number, version and flags, then per part
// its attributes (name, type, size, value) up to an empty name. Files with the multi-part flag have as many
// headers as parts, and an empty one behind them.
#include "io/exr_header_check.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <vector>

#include "io/file_bytes.h"

namespace kairos {
namespace {

constexpr uint32_t kTiled = 1 << 9, kDeep = 1 << 11, kMultiPart = 1 << 12;
constexpr int64_t kLargest = 1 << 16;  // pixels along an edge
constexpr size_t kLongestName = 255;   // OpenEXR's limit, and what ends a name without a closing zero

struct Window {
  int64_t width = 0, height = 0;
};

struct Tiles {
  uint32_t width = 0, height = 0;
};

struct Channel {
  int64_t bytes, xSampling, ySampling;  // per sample; pixels per sample
};

struct Part {
  std::optional<Window> window;
  std::optional<Tiles> tiles;
  std::optional<uint8_t> compression;
  std::vector<Channel> channels;
};

struct Attribute {
  std::string name, type;
  uint32_t size;
};

// The lines of one chunk and the most bytes of pixels that one byte of a file can stand for.
struct Packing {
  int64_t lines, ratio;
};

Packing packingOf(uint8_t compression) {
  constexpr int64_t kDeflate = 1032, kRunLength = 64, kHuffmanRuns = 454;  // 255 values of 16 bits in 9 bits
  // A byte of deflated constant terms stands for 1032 halves, each the mean of 8 x 8 samples of 4 bytes.
  constexpr int64_t kCosine = kDeflate / 2 * 64 * 4;
  switch (compression) {
    case 0:
      return {1, 1};
    case 1:
      return {1, kRunLength};
    case 2:
      return {1, kDeflate};
    case 3:  // ZIP
      return {16, kDeflate};
    case 4:  // PIZ
      return {32, kHuffmanRuns};
    case 5:  // PXR24 deflates 3 bytes of 4
      return {16, kDeflate * 4 / 3};
    case 6:  // B44, B44A: 3 bytes for 4 x 4 halves at best; floats are not packed
    case 7:
      return {32, 11};
    case 8:  // DWAA, DWAB
      return {32, kCosine};
    default:
      return {256, kCosine};
  }
}

std::string nameAt(ByteReader& in) {
  std::string name;
  while (const char c = in.get<char>()) {
    if (name.size() == kLongestName)
      in.fail("is damaged: a name at byte " + std::to_string(in.position() - name.size() - 1) +
              " of its header has no end");
    name += c;
  }
  return name;
}

Attribute attributeAt(ByteReader& in, std::string name) {
  Attribute attribute{std::move(name), nameAt(in), in.get<uint32_t>()};
  if (attribute.size > in.remaining())
    in.fail("is damaged or truncated: its attribute \"" + attribute.name + "\" claims " +
            std::to_string(attribute.size) + " bytes, " + std::to_string(in.remaining()) + " are left");
  return attribute;
}

// Zero for the types whose values have no fixed size.
uint64_t sizeOf(std::string_view type) {
  struct Size {
    uint64_t bytes;
    std::vector<std::string_view> types;
  };
  static const std::vector<Size> kSizes = {{1, {"compression", "deepImageState", "envmap", "lineOrder"}},
                                           {4, {"float", "int"}},
                                           {8, {"double", "rational", "timecode", "v2f", "v2i"}},
                                           {9, {"tiledesc"}},
                                           {12, {"v3f", "v3i"}},
                                           {16, {"box2f", "box2i", "v2d"}},
                                           {24, {"v3d"}},
                                           {28, {"keycode"}},
                                           {32, {"chromaticities"}},
                                           {36, {"m33f"}},
                                           {64, {"m44f"}},
                                           {72, {"m33d"}},
                                           {128, {"m44d"}}};
  for (const Size& size : kSizes)
    if (std::find(size.types.begin(), size.types.end(), type) != size.types.end()) return size.bytes;
  return 0;
}

void requireSize(const ByteReader& in, const Attribute& attribute, uint64_t size) {
  if (attribute.size != size)
    in.fail("is damaged: its attribute \"" + attribute.name + "\" has " + std::to_string(attribute.size) +
            " bytes, expected " + std::to_string(size));
}

Window windowAt(ByteReader& in) {
  const int64_t x0 = in.get<int32_t>(), y0 = in.get<int32_t>(), x1 = in.get<int32_t>(),
                y1 = in.get<int32_t>();
  const Window window{x1 - x0 + 1, y1 - y0 + 1};
  if (window.width < 1 || window.height < 1 || window.width > kLargest || window.height > kLargest)
    in.fail("is not a flat image of at most 65536 x 65536 pixels");
  return window;
}

std::vector<Channel> channelsAt(ByteReader& in) {
  std::vector<Channel> channels;
  for (std::string name = nameAt(in); !name.empty(); name = nameAt(in)) {
    const auto type = in.get<int32_t>();
    in.skip(4);  // how perception sees it
    const auto x = in.get<int32_t>(), y = in.get<int32_t>();
    if (x < 1 || y < 1)
      in.fail("is damaged: its channel \"" + name + "\" has a sample for every " + std::to_string(x) + " x " +
              std::to_string(y) + " pixels");
    channels.push_back({type == 1 ? 2 : 4, x, y});
  }
  return channels;
}

// A small picture of the image: OpenEXR makes room for its pixels without a look at the attribute's size.
void checkPreview(ByteReader& in, const Attribute& attribute) {
  const uint64_t width = in.get<uint32_t>(), height = in.get<uint32_t>();
  if (width > uint64_t(kLargest) || height > uint64_t(kLargest))
    in.fail("is damaged: its preview has " + std::to_string(width) + " x " + std::to_string(height) +
            " pixels");
  requireSize(in, attribute, 8 + 4 * width * height);
}

void checkStrings(ByteReader& in, const Attribute& attribute, uint64_t end) {
  while (in.position() < end) {
    const auto length = in.get<uint32_t>();
    if (length > end - std::min(end, in.position()))
      in.fail("is damaged: a text of " + std::to_string(length) + " bytes in its attribute \"" +
              attribute.name + "\" of " + std::to_string(attribute.size));
    in.skip(length);
  }
}

void refuseDeep(ByteReader& in, const Attribute& attribute) {
  std::string type(std::min<size_t>(attribute.size, kLongestName), '\0');
  in.read(type.data(), type.size());
  if (type.starts_with("deep")) in.fail("is a deep image, expected a flat one");
}

// OpenEXR reads what a type needs, whatever size is claimed, and goes on from there: the two must agree.
void readValue(ByteReader& in, const Attribute& attribute, Part& part) {
  const uint64_t begin = in.position(), end = begin + attribute.size;
  if (const uint64_t size = sizeOf(attribute.type)) requireSize(in, attribute, size);
  if (attribute.name == "dataWindow") part.window = windowAt(in);
  if (attribute.name == "compression") part.compression = in.get<uint8_t>();
  if (attribute.name == "tiles") part.tiles = {in.get<uint32_t>(), in.get<uint32_t>()};
  if (attribute.name == "type") refuseDeep(in, attribute);
  if (attribute.name == "channels") {
    part.channels = channelsAt(in);
    requireSize(in, attribute, in.position() - begin);
  }
  if (attribute.type == "preview") checkPreview(in, attribute);
  if (attribute.type == "stringvector") checkStrings(in, attribute, end);
  in.seek(end);
}

// Attributes up to the empty name, whose first is `name`.
Part partAt(ByteReader& in, std::string name) {
  Part part;
  for (; !name.empty(); name = nameAt(in)) {
    const Attribute attribute = attributeAt(in, name);
    readValue(in, attribute, part);
  }
  if (!part.window || !part.compression || part.channels.empty())
    in.fail("is damaged: its header lacks the data window, the compression or the channels");
  return part;
}

int64_t pixelBytes(const Part& part) {
  int64_t sum = 0;
  for (const Channel& c : part.channels)
    sum += c.bytes * (part.window->width / c.xSampling) * (part.window->height / c.ySampling);
  return sum;
}

// OpenEXR keeps whole tiles of the size claimed, also where the image is smaller.
Tiles tilesOf(const ByteReader& in, const Part& part) {
  constexpr int64_t kUsual = 2048;
  if (!part.tiles || part.tiles->width < 1 || part.tiles->height < 1)
    in.fail("is damaged: its tiles have no size");
  if (int64_t(part.tiles->width) > std::max(kUsual, part.window->width) ||
      int64_t(part.tiles->height) > std::max(kUsual, part.window->height))
    in.fail("claims tiles of " + std::to_string(part.tiles->width) + " x " +
            std::to_string(part.tiles->height) + " pixels in an image of " +
            std::to_string(part.window->width) + " x " + std::to_string(part.window->height));
  return *part.tiles;
}

// How many chunks the part has; throws where one would take more memory than any image needs for one.
int64_t chunksOf(const ByteReader& in, const Part& part, bool tiled) {
  constexpr int64_t kLargestChunk = int64_t(1) << 30;  // bytes
  const auto ceilDivided = [](int64_t a, int64_t b) { return (a + b - 1) / b; };
  Window chunk{part.window->width, packingOf(*part.compression).lines};
  if (tiled) {
    const Tiles tiles = tilesOf(in, part);
    chunk = {tiles.width, tiles.height};
  }
  int64_t bytes = 0;
  for (const Channel& c : part.channels) bytes += c.bytes * (chunk.width / c.xSampling) * chunk.height;
  if (bytes > kLargestChunk)
    in.fail("claims " + std::to_string(bytes) + " bytes for one of its chunks, expected at most 1 GiB");
  return ceilDivided(part.window->width, chunk.width) * ceilDivided(part.window->height, chunk.height);
}

}  // namespace

void checkExrHeader(const std::string& path, std::span<const char> bytes) {
  ByteReader in(path, bytes);
  in.skip(4);  // the magic number
  const auto flags = in.get<uint32_t>();
  if (flags & kDeep) in.fail("is a deep image, expected a flat one");
  int64_t chunks = 0;
  for (std::string name = nameAt(in); !name.empty(); name = nameAt(in)) {
    const Part part = partAt(in, name);
    if (pixelBytes(part) > packingOf(*part.compression).ratio * int64_t(bytes.size()))
      in.fail("claims more pixels than its bytes can hold");
    chunks += chunksOf(in, part, flags & kTiled || part.tiles);
    // Its table has eight bytes for every chunk.
    if (8 * chunks > int64_t(bytes.size())) in.fail("claims more lines or tiles than its bytes can hold");
    if (!(flags & kMultiPart)) break;
  }
}

}  // namespace kairos
