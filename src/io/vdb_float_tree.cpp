#include "io/vdb_float_tree.h"

#include <blosc.h>
#include <zlib.h>

#include <bit>
#include <cstring>
#include <stdexcept>

#include "io/half_rows.h"
#include "io/vdb_node_codes.h"

namespace kairos {
namespace {

template <class T>
T take(const char*& p) {
  T value;
  std::memcpy(&value, p, sizeof(T));
  p += sizeof(T);
  return value;
}

bool isSet(const std::vector<uint64_t>& mask, size_t i) {
  return mask[i / 64] >> (i % 64) & 1;
}

bool sameFloat(float a, float b) {
  return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b);
}

// What the values that are not stored are: `off`, or `on` where the selection mask has its bit.
struct InactiveValues {
  float off, on;
  const char* selection = nullptr;

  float operator()(size_t i) const {
    const bool chosen = selection != nullptr && (uint8_t(selection[i / 8]) >> (i % 8) & 1) != 0;
    return chosen ? on : off;
  }
};

InactiveValues inactiveValues(const char*& p, int code, size_t count, float background) {
  InactiveValues values{code == kBackground ? background : -background, background};
  if (inactiveValueCount(code) >= 1) values.off = take<float>(p);
  if (inactiveValueCount(code) >= 2) values.on = take<float>(p);
  if (hasSelectionMask(code)) {
    values.selection = p;
    p += count / 8;
  }
  return values;
}

}  // namespace

float VdbFloatTree::background() const {
  const char* p = tree_.data() + sizeof(uint32_t);  // behind the number of buffers
  return take<float>(p);
}

VdbLeafMask VdbFloatTree::activeVoxels(const VdbTreeParts::Leaf& leaf) const {
  const char* p = at(leaf.buffer);
  return take<VdbLeafMask>(p);
}

void VdbFloatTree::decode(const VdbTreeParts::Leaf& leaf, float* out) {
  const VdbLeafMask active = activeVoxels(leaf);
  values(at(leaf.buffer) + sizeof active, active.data(), kVdbLeafVoxels, out);
}

// The bytes of `count` stored values, decompressed where they are not.
const char* VdbFloatTree::stored(const char* p, size_t count) {
  const size_t bytes = count * (grid_.half ? sizeof(half) : sizeof(float));
  if (!(grid_.compression & (kZip | kBlosc)) || (grid_.half && count == 0)) return p;
  const auto size = take<int64_t>(p);
  if (size <= 0) return p;
  decompressed_.resize(bytes);
  uLongf length = uLongf(bytes);
  const bool complete = grid_.compression & kBlosc
                            ? blosc_decompress_ctx(p, decompressed_.data(), bytes, 1) == int64_t(bytes)
                            : uncompress(reinterpret_cast<Bytef*>(decompressed_.data()), &length,
                                         reinterpret_cast<const Bytef*>(p), uLong(size)) == Z_OK &&
                                  length == bytes;
  if (!complete) throw std::runtime_error("a block that cannot be decompressed");
  return decompressed_.data();
}

// The values of one node, from the code of how they are stored on (OpenVDB's readCompressedValues).
void VdbFloatTree::values(const char* p, const uint64_t* active, size_t count, float* out) {
  const int code = take<int8_t>(p);
  const InactiveValues inactive = inactiveValues(p, code, count, background());
  size_t storedCount = count;
  if ((grid_.compression & kActiveMask) && code != kAllValues) {
    storedCount = 0;
    for (size_t w = 0; w < count / 64; ++w) storedCount += size_t(std::popcount(active[w]));
  }
  const char* bytes = stored(p, storedCount);
  float* packed = out;
  if (storedCount < count) {
    packed_.resize(count);
    packed = packed_.data();
  }
  if (grid_.half)
    toFloats(bytes, storedCount, packed);
  else if (storedCount > 0)  // an empty block has no address
    std::memcpy(packed, bytes, storedCount * sizeof(float));
  if (storedCount == count) return;
  for (size_t w = 0; w < count / 64; ++w) {
    if (active[w] == ~uint64_t(0)) {
      std::memcpy(out + 64 * w, packed, 64 * sizeof(float));
      packed += 64;
      continue;
    }
    for (size_t i = 64 * w; i < 64 * w + 64; ++i)
      out[i] = active[w] >> (i % 64) & 1 ? *packed++ : inactive(i);
  }
}

void VdbFloatTree::addTilesOf(const VdbTreeParts::InternalNode& node, std::vector<Tile>& tiles) {
  const size_t edge = size_t(node.edge), count = edge * edge * edge;
  std::vector<uint64_t> children(count / 64), active(count / 64);
  const char* p = at(node.masks);
  std::memcpy(children.data(), p, count / 8);
  std::memcpy(active.data(), p + count / 8, count / 8);
  nodeValues_.resize(count);
  values(p + count / 4, active.data(), count, nodeValues_.data());
  for (size_t i = 0; i < count; ++i) {
    if (isSet(children, i) || (!isSet(active, i) && sameFloat(nodeValues_[i], background()))) continue;
    const Vec3i place{int(i / (edge * edge)), int(i / edge % edge), int(i % edge)};
    tiles.push_back({node.origin + place * node.childSpan, node.childSpan, nodeValues_[i], isSet(active, i)});
  }
}

std::vector<VdbFloatTree::Tile> VdbFloatTree::tiles() {
  constexpr int kRootSpan = 4096;
  std::vector<Tile> tiles;
  for (const VdbTreeParts::RootTile& tile : parts_.rootTiles) {
    const char* p = at(tile.value);
    const auto value = take<float>(p);
    tiles.push_back({tile.origin, kRootSpan, value, take<uint8_t>(p) != 0});
  }
  for (const VdbTreeParts::InternalNode& node : parts_.internalNodes) addTilesOf(node, tiles);
  return tiles;
}

}  // namespace kairos
