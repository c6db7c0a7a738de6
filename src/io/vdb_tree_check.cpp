// Walks the bytes of a tree the way OpenVDB reads them (format 222 to 224, trees of configuration 5-4-3).
#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "io/vdb_container.h"
#include "io/vdb_node_codes.h"

namespace kairos {
namespace {

constexpr int kUpperEdge = 32, kLowerEdge = 16, kLeafEdgeVdb = 8;
constexpr int kLowerSpan = kLowerEdge * kLeafEdgeVdb, kUpperSpan = kUpperEdge * kLowerSpan;

class TreeWalker {
 public:
  TreeWalker(ByteReader& reader, const VdbGridHeader& grid) : in_(reader), grid_(grid), type_(*grid.type()) {}

  VdbTreeParts walk() {
    if (in_.get<uint32_t>() != 1) damaged("an unknown number of buffers");
    in_.skip(uint64_t(type_.valueBytes));  // background
    const auto tiles = in_.get<uint32_t>(), children = in_.get<uint32_t>();
    for (uint32_t i = 0; i < tiles; ++i) {
      const Vec3i origin = readOrigin();
      parts_.rootTiles.push_back({origin, in_.position()});
      in_.skip(uint64_t(type_.valueBytes));
      if (in_.get<uint8_t>() > 1) damaged("a tile that is neither active nor inactive");
    }
    for (uint32_t i = 0; i < children; ++i) {
      roots_.push_back({readOrigin(), parts_.leaves.size(), 0});
      internalNode(roots_.back().origin, kUpperEdge, kLowerSpan);
      roots_.back().leafEnd = parts_.leaves.size();
    }
    walkBuffers();
    return std::move(parts_);
  }

 private:
  struct Root {
    Vec3i origin;
    size_t leafBegin, leafEnd;
  };

  [[noreturn]] void damaged(const std::string& what) const {
    in_.fail("is damaged: the tree of grid \"" + grid_.name + "\" has " + what + " near byte " +
             std::to_string(in_.position()));
  }

  Vec3i readOrigin() {
    const auto v = in_.get<Vec3i>();
    for (int a = 0; a < 3; ++a)
      if (v[a] % kUpperSpan != 0) damaged("a node at an impossible place");
    return v;
  }

  // Loads a mask of `words` words and returns how many bits are set.
  int readMask(std::vector<uint64_t>& mask, size_t words) {
    mask.resize(words);
    in_.read(reinterpret_cast<char*>(mask.data()), words * sizeof(uint64_t));
    int on = 0;
    for (uint64_t word : mask) on += std::popcount(word);
    return on;
  }

  // The masks and tile values of an internal node, then its children.
  void internalNode(const Vec3i& origin, int edge, int childSpan) {
    const size_t count = size_t(edge) * edge * edge;
    parts_.internalNodes.push_back({origin, edge, childSpan, in_.position()});
    std::vector<uint64_t> children, active;
    readMask(children, count / 64);
    const int activeTiles = readMask(active, count / 64);
    for (size_t w = 0; w < children.size(); ++w)
      if (children[w] & active[w]) damaged("a tile where a node stands");
    compressedValues(int(count), activeTiles);
    for (size_t i = 0; i < count; ++i) {
      if (!(children[i / 64] >> (i % 64) & 1)) continue;
      const int n = int(i), x = n / (edge * edge), y = n / edge % edge, z = n % edge;
      const Vec3i child = origin + Vec3i{x, y, z} * childSpan;
      if (edge == kUpperEdge) {
        internalNode(child, kLowerEdge, kLeafEdgeVdb);
      } else {
        in_.skip(kLeafMaskBytes);
        parts_.leaves.push_back({child, 0});
      }
    }
  }

  // OpenVDB keeps the root's children in a map, and reads the buffers in its order rather than the file's.
  void walkBuffers() {
    inTopology_ = false;
    const auto key = [](const Root& r) { return std::tuple(r.origin.x, r.origin.y, r.origin.z); };
    std::sort(roots_.begin(), roots_.end(), [&](const Root& a, const Root& b) { return key(a) < key(b); });
    for (size_t i = 0; i < roots_.size(); ++i) {
      if (i > 0 && roots_[i].origin == roots_[i - 1].origin) damaged("two nodes at one place");
      for (size_t leaf = roots_[i].leafBegin; leaf < roots_[i].leafEnd; ++leaf)
        leafBuffer(parts_.leaves[leaf]);
    }
  }

  void leafBuffer(VdbTreeParts::Leaf& leaf) {
    leaf.buffer = in_.position();
    const int active = readMask(mask_, kLeafMaskBytes / sizeof(uint64_t));
    if (type_.leaf == VdbGridType::Leaf::values) return compressedValues(512, active);
    if (in_.get<Vec3i>() != leaf.origin) damaged("a leaf at the wrong place");
    if (type_.leaf == VdbGridType::Leaf::boolean) in_.skip(kLeafMaskBytes);
  }

  void compressedValues(int count, int active) {
    const int code = in_.get<int8_t>();
    if (code < 0 || code > kAllValues) damaged("an unknown kind of node");
    in_.skip(uint64_t(inactiveValueCount(code) * type_.valueBytes));
    if (hasSelectionMask(code)) in_.skip(uint64_t(count) / 8);
    const int stored = (grid_.compression & kActiveMask) && code != kAllValues ? active : count;
    if (grid_.half && type_.halfBytes != type_.valueBytes) {
      if (stored > 0) chunk(int64_t(stored) * type_.halfBytes);
    } else {
      chunk(int64_t(stored) * type_.valueBytes);
    }
  }

  // `bytes` of values: raw, or a compressed chunk preceded by its size (negative: not compressed after all).
  void chunk(int64_t bytes) {
    if (!(grid_.compression & (kZip | kBlosc))) return in_.skip(uint64_t(bytes));
    const auto size = in_.get<int64_t>();
    if (size <= 0) {
      if (size != -bytes) damaged("a block of the wrong size");
      return in_.skip(uint64_t(bytes));
    }
    if (uint64_t(size) > in_.remaining()) damaged("a block that reaches beyond the end of the file");
    if (grid_.compression & kBlosc) checkBloscHeader(bytes, size);
    if (!inTopology_) return in_.skip(uint64_t(size));
    // OpenVDB loses the nodes it has made so far when a block of the topology turns out to be damaged. Blocks
    // of leaves, which are nearly all of the file, may be left to it.
    compressed_.resize(size_t(size));
    in_.read(compressed_.data(), compressed_.size());
    if (!decodes(bytes)) damaged("a block that cannot be decompressed");
  }

  // Does `compressed_` hold this many bytes?
  bool decodes(int64_t bytes) {
    decoded_.resize(size_t(std::max<int64_t>(bytes, 1)));
    if (grid_.compression & kBlosc)
      return blosc_decompress_ctx(compressed_.data(), decoded_.data(), size_t(bytes), 1) == bytes;
    uLongf length = uLongf(bytes);
    return uncompress(decoded_.data(), &length, reinterpret_cast<const Bytef*>(compressed_.data()),
                      uLong(compressed_.size())) == Z_OK &&
           int64_t(length) == bytes;
  }

  // Blosc believes the sizes in its header, which must therefore agree with those around it.
  void checkBloscHeader(int64_t bytes, int64_t size) {
    struct Header {
      uint8_t version, codecVersion, flags, typeSize;
      int32_t bytes, blockSize, compressedBytes;
    };
    if (size < int64_t(sizeof(Header))) damaged("a block that is too short");
    const auto h = in_.get<Header>();
    if (h.bytes != bytes || h.compressedBytes != size || h.typeSize == 0 || (bytes > 0 && h.blockSize <= 0) ||
        h.blockSize > std::max<int64_t>(bytes, 1))
      damaged("a block whose sizes contradict each other");
    in_.seek(in_.position() - sizeof(Header));
  }

  static constexpr uint64_t kLeafMaskBytes = 64;

  ByteReader& in_;
  const VdbGridHeader& grid_;
  const VdbGridType& type_;
  std::vector<Root> roots_;
  VdbTreeParts parts_;
  std::vector<uint64_t> mask_;
  bool inTopology_ = true;
  std::vector<char> compressed_;
  std::vector<Bytef> decoded_;
};

}  // namespace

VdbTreeParts checkTree(ByteReader& reader, const VdbGridHeader& grid) {
  return TreeWalker(reader, grid).walk();
}

}  // namespace kairos
