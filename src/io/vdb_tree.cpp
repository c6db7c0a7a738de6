#include "io/vdb_tree.h"

#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <type_traits>

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

// A value of a tree; booleans are any byte but 0.
template <class V>
V takeValue(const char*& p) {
  const auto value = take<V>(p);
  if constexpr (std::is_same_v<V, uint8_t>) return value != 0;
  return value;
}

bool isSet(const std::vector<uint64_t>& mask, size_t i) {
  return mask[i / 64] >> (i % 64) & 1;
}

template <class V>
bool sameBits(V a, V b) {
  return std::memcmp(&a, &b, sizeof(V)) == 0;
}

// OpenVDB's negative of a background, which exists for booleans too.
template <class V>
V negative(V v) {
  if constexpr (std::is_same_v<V, uint8_t>)
    return v == 0;
  else if constexpr (std::is_integral_v<V>)
    return V(0 - std::make_unsigned_t<V>(v));
  else
    return -v;
}

// What the values that are not stored are: `off`, or `on` where the selection mask has its bit.
template <class V>
struct InactiveValues {
  V off, on;
  const char* selection = nullptr;

  V operator()(size_t i) const {
    const bool chosen = selection != nullptr && (uint8_t(selection[i / 8]) >> (i % 8) & 1) != 0;
    return chosen ? on : off;
  }
};

template <class V>
InactiveValues<V> inactiveValues(const char*& p, int code, size_t count, V background) {
  InactiveValues<V> values{code == kBackground ? background : negative(background), background};
  if (inactiveValueCount(code) >= 1) values.off = takeValue<V>(p);
  if (inactiveValueCount(code) >= 2) values.on = takeValue<V>(p);
  if (hasSelectionMask(code)) {
    values.selection = p;
    p += count / 8;
  }
  return values;
}

// Puts eight values into place, the stored ones where `active` has bits; returns where the next stored one
// is.
template <class V>
const V* scatterRow(uint64_t active, const V* packed, size_t first, const InactiveValues<V>& inactive,
                    V* out) {
  if (active == 0xff) {
    std::copy_n(packed, 8, out);
    return packed + 8;
  }
  if (inactive.selection == nullptr)
    std::fill_n(out, 8, inactive.off);
  else
    for (size_t i = 0; i < 8; ++i) out[i] = inactive(first + i);
  for (; active != 0; active &= active - 1) out[std::countr_zero(active)] = *packed++;
  return packed;
}

void expand(const VdbLeafMask& bits, uint8_t* out) {
  for (size_t i = 0; i < size_t(kVdbLeafVoxels); ++i) out[i] = bits[i / 64] >> (i % 64) & 1;
}

}  // namespace

template <class V>
VdbTree<V>::VdbTree(std::span<const char> tree, const VdbGridHeader& grid, const VdbTreeParts& parts)
    : tree_(tree),
      grid_(grid),
      parts_(parts),
      halves_(grid.half && grid.type()->halfBytes != grid.type()->valueBytes) {
  const char* p = tree_.data() + sizeof(uint32_t);  // behind the number of buffers
  background_ = takeValue<V>(p);
}

template <class V>
VdbLeafMask VdbTree<V>::activeVoxels(const VdbTreeParts::Leaf& leaf) const {
  const char* p = at(leaf.buffer);
  return take<VdbLeafMask>(p);
}

template <class V>
void VdbTree<V>::decode(const VdbTreeParts::Leaf& leaf, V* out) {
  const VdbLeafMask active = activeVoxels(leaf);
  const char* p = at(leaf.buffer) + sizeof active;
  if constexpr (std::is_same_v<V, uint8_t>) {
    // Bits instead of values: behind the leaf's origin, or the active voxels themselves.
    p += sizeof(Vec3i);
    expand(grid_.type()->leaf == VdbGridType::Leaf::boolean ? take<VdbLeafMask>(p) : active, out);
  } else {
    values(p, active.data(), kVdbLeafVoxels, out);
  }
}

// The bytes of `count` stored values, decompressed where they are not.
template <class V>
const char* VdbTree<V>::stored(const char* p, size_t count) {
  const size_t bytes = count * (halves_ ? sizeof(half) : sizeof(V));
  if (!(grid_.compression & (kZip | kBlosc)) || (halves_ && count == 0)) return p;
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

template <class V>
void VdbTree<V>::load(const char* bytes, size_t count, V* out) {
  if (count == 0) return;  // an empty block has no address
  if constexpr (std::is_same_v<V, uint8_t>) {
    for (size_t i = 0; i < count; ++i) out[i] = bytes[i] != 0;
  } else if (!halves_) {
    std::memcpy(out, bytes, count * sizeof(V));
  } else if constexpr (std::is_same_v<V, float>) {
    toFloats(bytes, count, out);
  } else if constexpr (std::is_same_v<V, double>) {
    floats_.resize(count);
    toFloats(bytes, count, floats_.data());
    std::copy_n(floats_.data(), count, out);
  }
}

// The values of one node, from the code of how they are stored on (OpenVDB's readCompressedValues).
template <class V>
void VdbTree<V>::values(const char* p, const uint64_t* active, size_t count, V* out) {
  const int code = take<int8_t>(p);
  const InactiveValues<V> inactive = inactiveValues(p, code, count, background_);
  size_t storedCount = count;
  if ((grid_.compression & kActiveMask) && code != kAllValues) {
    storedCount = 0;
    for (size_t w = 0; w < count / 64; ++w) storedCount += size_t(std::popcount(active[w]));
  }
  const char* bytes = stored(p, storedCount);
  if (storedCount == count) return load(bytes, count, out);
  packed_.resize(count);
  load(bytes, storedCount, packed_.data());
  const V* packed = packed_.data();
  for (size_t i = 0; i < count; i += 8)
    packed = scatterRow(active[i / 64] >> (i % 64) & 0xff, packed, i, inactive, out + i);
}

template <class V>
void VdbTree<V>::addTilesOf(const VdbTreeParts::InternalNode& node, std::vector<Tile>& tiles) {
  const size_t edge = size_t(node.edge), count = edge * edge * edge;
  std::vector<uint64_t> children(count / 64), active(count / 64);
  const char* p = at(node.masks);
  std::memcpy(children.data(), p, count / 8);
  std::memcpy(active.data(), p + count / 8, count / 8);
  // The usual node has children and background alone, and says so.
  const bool anyActive = std::any_of(active.begin(), active.end(), [](uint64_t word) { return word != 0; });
  if (!anyActive && (grid_.compression & kActiveMask) && int8_t(p[count / 4]) == kBackground) return;
  nodeValues_.resize(count);
  values(p + count / 4, active.data(), count, nodeValues_.data());
  for (size_t i = 0; i < count; ++i) {
    if (isSet(children, i) || (!isSet(active, i) && sameBits(nodeValues_[i], background_))) continue;
    const Vec3i place{int(i / (edge * edge)), int(i / edge % edge), int(i % edge)};
    tiles.push_back({node.origin + place * node.childSpan, node.childSpan, nodeValues_[i], isSet(active, i)});
  }
}

template <class V>
auto VdbTree<V>::tiles() -> std::vector<Tile> {
  constexpr int kRootSpan = 4096;
  std::vector<Tile> tiles;
  for (const VdbTreeParts::RootTile& tile : parts_.rootTiles) {
    const char* p = at(tile.value);
    const auto value = takeValue<V>(p);
    tiles.push_back({tile.origin, kRootSpan, value, take<uint8_t>(p) != 0});
  }
  for (const VdbTreeParts::InternalNode& node : parts_.internalNodes) addTilesOf(node, tiles);
  return tiles;
}

template class VdbTree<float>;
template class VdbTree<double>;
template class VdbTree<int32_t>;
template class VdbTree<int64_t>;
template class VdbTree<uint8_t>;

}  // namespace kairos
