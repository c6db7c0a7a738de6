#include "io/vdb_field.h"

#include <openvdb/io/Archive.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <istream>
#include <limits>
#include <new>
#include <sstream>
#include <streambuf>

#include "io/vdb_float_tree.h"

namespace kairos {
namespace {

constexpr uint64_t kMaxLeaves = uint64_t(1) << 26;
constexpr int32_t kFarthest = 1 << 30;  // keeps sums of coordinates inside 32 bits

constexpr int vdbOffset(int x, int y, int z) {
  return x * 64 + y * 8 + z;
}

// OpenVDB's offset (z fastest) of our offset (x fastest).
constexpr int vdbOffsetOf(int offset) {
  return vdbOffset(offset & 7, (offset >> 3) & 7, offset >> 6);
}

Vec3i toVec(const openvdb::Coord& c) {
  return {c.x(), c.y(), c.z()};
}
openvdb::Coord toCoord(const Vec3i& v) {
  return {v.x, v.y, v.z};
}

// A stream over bytes in memory, which are not copied.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(std::span<const char> bytes) {
    char* begin = const_cast<char*>(bytes.data());  // only read from
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    const off_type position = base + offset;
    if (position < 0 || position > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + position, egptr());
    return pos_type(position);
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override {
    return seekoff(off_type(position), std::ios_base::beg, mode);
  }
};

template <class TreeT>
void readTree(TreeT& tree, const VdbContainer& file, const VdbGridHeader& grid, std::span<const char> bytes) {
  MemoryBuffer buffer(bytes);
  std::istream stream(&buffer);
  openvdb::io::setVersion(stream, {file.libraryMajor, file.libraryMinor}, file.fileVersion);
  openvdb::io::setDataCompression(stream, grid.compression);
  openvdb::io::setGridBackgroundValuePtr(stream, nullptr);
  tree.readTopology(stream, grid.half);
  tree.readBuffers(stream, grid.half);
}

// Checks the tree's structure, then runs `body`, turning whatever the library throws into an InputError.
template <class F>
auto guarded(const std::string& path, const VdbGridHeader& grid, std::span<const char> tree, F&& body) {
  try {
    ByteReader reader(path, tree, grid.treeBegin);
    const VdbTreeParts parts = checkTree(reader, grid);
    if (reader.remaining() != 0)
      reader.fail("is damaged: the tree of grid \"" + grid.name + "\" ends before its block");
    return body(parts);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw InputError(path, "grid \"" + grid.name + "\" needs more memory than there is");
  } catch (const std::exception& e) {
    throw InputError(path, "is damaged: grid \"" + grid.name + "\" cannot be decoded (" + e.what() + ")");
  }
}

template <class T, class V>
T converted(V value, const std::string& path) {
  if constexpr (std::is_same_v<T, float> || std::is_same_v<V, bool>) {
    return T(value);
  } else {
    if (value >= V(0) && value <= V(std::numeric_limits<T>::max()) && value == std::floor(value))
      return T(value);
    throw InputError(path, "holds the value " + std::to_string(value) + ", expected whole numbers in [0, " +
                               std::to_string(std::numeric_limits<T>::max()) + "]");
  }
}

template <class T>
bool sameBits(T a, T b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

// What fills one of our leaves: a leaf of the tree, or (null) a part of a tile.
template <class Leaf, class V>
struct Block {
  Vec3i origin;
  const Leaf* leaf;
  V tile;
};

// The blocks of a tree with values of type V, for a field of type T.
template <class Leaf, class V, class T>
class BlockList {
 public:
  BlockList(T background, const std::string& path) : path_(path), background_(background) {}

  void addLeaf(const Vec3i& origin, const Leaf& leaf) { add({origin, &leaf, V()}); }

  void addTile(const Vec3i& origin, int edge, V value) {
    const T v = converted<T>(value, path_);
    if (sameBits(v, background_) || v == background_) return;  // -0 as a tile is as good as 0
    const uint64_t leaves =
        uint64_t(edge / kLeafEdge) * uint64_t(edge / kLeafEdge) * uint64_t(edge / kLeafEdge);
    require(leaves);
    for (int z = 0; z < edge; z += kLeafEdge)
      for (int y = 0; y < edge; y += kLeafEdge)
        for (int x = 0; x < edge; x += kLeafEdge) add({origin + Vec3i{x, y, z}, nullptr, value});
  }

  const std::vector<Block<Leaf, V>>& sorted() {
    std::sort(blocks_.begin(), blocks_.end(),
              [](const auto& a, const auto& b) { return lessZYX(a.origin, b.origin); });
    return blocks_;
  }

 private:
  void add(const Block<Leaf, V>& block) {
    for (int a = 0; a < 3; ++a)
      if (block.origin[a] < -kFarthest || block.origin[a] > kFarthest)
        throw InputError(path_, "has a voxel at index " + std::to_string(block.origin[a]) +
                                    ", expected indices within +-2^30");
    require(1);
    blocks_.push_back(block);
  }

  void require(uint64_t more) const {
    const uint64_t leaves = blocks_.size() + more;
    const double bytes = double(leaves) * kLeafVoxels * sizeof(T);
    static const double physical = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGESIZE));
    if (leaves > kMaxLeaves || bytes > physical)
      throw InputError(path_, "its active and inactive tiles would fill more than " +
                                  std::to_string(leaves - 1) + " leaves of 8^3 voxels, which is more than " +
                                  (leaves > kMaxLeaves ? "2^26" : "fits into memory"));
  }

  const std::string& path_;
  T background_;
  std::vector<Block<Leaf, V>> blocks_;
};

template <class Node, class List>
void addNode(const Node& node, List& list) {
  using Child = typename Node::ChildNodeType;
  for (auto it = node.cbeginValueAll(); it; ++it)
    list.addTile(toVec(it.getCoord()), int(Child::DIM), it.getValue());
  for (auto it = node.cbeginChildOn(); it; ++it) {
    if constexpr (Child::LEVEL == 0)
      list.addLeaf(toVec(it->origin()), *it);
    else
      addNode(*it, list);
  }
}

// Grows `bounds` by the voxels of a leaf that differ from the background; false when there are none.
template <class T>
bool growBounds(const Vec3i& origin, const T* values, T background, VoxelBox& bounds) {
  VoxelBox part{{kLeafEdge, kLeafEdge, kLeafEdge}, {0, 0, 0}};
  for (int row = 0; row < kLeafEdge * kLeafEdge; ++row) {
    uint32_t differs = 0;
    for (int x = 0; x < kLeafEdge; ++x)
      differs |= uint32_t(bitsOf(values[kLeafEdge * row + x]) != bitsOf(background)) << x;
    if (differs == 0) continue;
    part.lo = componentMin(part.lo, {std::countr_zero(differs), row % kLeafEdge, row / kLeafEdge});
    part.hi = componentMax(part.hi, {int(std::bit_width(differs)), row % kLeafEdge + 1, row / kLeafEdge + 1});
  }
  if (part.empty()) return false;
  bounds = unite(bounds, {origin + part.lo, origin + part.hi});
  return true;
}

// Fills the field's leaves from a list of blocks; `decode(leaf, voxels)` writes a leaf's 512 values.
template <class T, class List, class Decode>
Field fieldOfBlocks(List& list, T background, const std::string& path, Decode&& decode) {
  Field field;
  field.background = double(background);
  const auto& blocks = list.sorted();
  std::vector<T> values(blocks.size() * kLeafVoxels);
  size_t kept = 0;
  for (const auto& block : blocks) {
    T* out = values.data() + kept * kLeafVoxels;
    if (block.leaf)
      decode(*block.leaf, out);
    else
      std::fill_n(out, kLeafVoxels, converted<T>(block.tile, path));
    if (!growBounds(block.origin, out, background, field.bounds)) continue;
    field.leafOrigins.push_back(block.origin);
    ++kept;
  }
  values.resize(kept * kLeafVoxels);
  field.values = std::move(values);
  return field;
}

// Any tree, by the library.
template <class TreeT, class T>
Field readField(const std::string& path, const VdbContainer& file, const VdbGridHeader& grid,
                std::span<const char> bytes) {
  using Leaf = typename TreeT::LeafNodeType;
  return guarded(path, grid, bytes, [&](const VdbTreeParts&) {
    TreeT tree;
    readTree(tree, file, grid, bytes);
    const T background = converted<T>(tree.background(), path);
    BlockList<Leaf, typename TreeT::ValueType, T> list(background, path);
    addNode(tree.root(), list);
    return fieldOfBlocks(list, background, path, [&](const Leaf& leaf, T* out) {
      for (int i = 0; i < kLeafVoxels; ++i)
        out[i] = converted<T>(leaf.getValue(openvdb::Index(vdbOffsetOf(i))), path);
    });
  });
}

// From OpenVDB's order of a leaf's voxels to ours.
template <class T>
void reorder(const float* values, T* out, const std::string& path) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (int y = 0; y < kLeafEdge; ++y)
      for (int x = 0; x < kLeafEdge; ++x)
        out[leafOffset(x, y, z)] = converted<T>(values[vdbOffset(x, y, z)], path);
}

// A float tree, straight from the bytes: several times faster than building the library's tree first.
template <class T>
Field readFloatField(const std::string& path, const VdbGridHeader& grid, std::span<const char> bytes) {
  return guarded(path, grid, bytes, [&](const VdbTreeParts& parts) {
    VdbFloatTree tree(bytes, grid, parts);
    const T background = converted<T>(tree.background(), path);
    BlockList<VdbTreeParts::Leaf, float, T> list(background, path);
    for (const VdbFloatTree::Tile& tile : tree.tiles()) list.addTile(tile.origin, tile.edge, tile.value);
    for (const VdbTreeParts::Leaf& leaf : tree.leaves()) list.addLeaf(leaf.origin, leaf);
    float decoded[kLeafVoxels];
    return fieldOfBlocks(list, background, path, [&](const VdbTreeParts::Leaf& leaf, T* out) {
      tree.decode(leaf, decoded);
      reorder(decoded, out, path);
    });
  });
}

// Transposes an 8 x 8 matrix of bits, row by row in the bytes of `m` (Warren, Hacker's Delight, 7-3).
constexpr uint64_t transposed(uint64_t m) {
  uint64_t t = (m ^ (m >> 7)) & 0x00aa00aa00aa00aa;
  m ^= t ^ (t << 7);
  t = (m ^ (m >> 14)) & 0x0000cccc0000cccc;
  m ^= t ^ (t << 14);
  t = (m ^ (m >> 28)) & 0x00000000f0f0f0f0;
  return m ^ t ^ (t << 28);
}

// From OpenVDB's order (word x, byte y, bit z) to ours (word z, byte y, bit x).
std::array<uint64_t, 8> reorderedMask(const VdbLeafMask& mask) {
  std::array<uint64_t, 8> reordered{};
  for (int y = 0; y < kLeafEdge; ++y) {
    uint64_t plane = 0;  // row x, bit z
    for (size_t x = 0; x < 8; ++x) plane |= (mask[x] >> (8 * y) & 0xff) << (8 * x);
    plane = transposed(plane);
    for (size_t z = 0; z < 8; ++z) reordered[z] |= (plane >> (8 * z) & 0xff) << (8 * y);
  }
  return reordered;
}

// The values of a leaf's changed voxels, in our order; `leaf.mask` is complete.
template <class T>
void appendChanged(const ChangedLeaf& leaf, const float* values, const std::string& path,
                   std::vector<T>& changed) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1)
      changed.push_back(converted<T>(values[vdbOffsetOf(64 * z + std::countr_zero(word))], path));
}

template <class T>
ChangedVoxels changesOf(VdbFloatTree& tree, const std::string& path) {
  for (const VdbFloatTree::Tile& tile : tree.tiles())
    if (tile.active) throw InputError(path, "holds active tiles; a differential file has single voxels only");
  struct Source {
    ChangedLeaf changed;
    const VdbTreeParts::Leaf* leaf;
  };
  std::vector<Source> sources;
  sources.reserve(tree.leaves().size());
  uint64_t count = 0;
  for (const VdbTreeParts::Leaf& leaf : tree.leaves()) {
    const ChangedLeaf changed{leaf.origin, reorderedMask(tree.activeVoxels(leaf)), 0};
    if (changed.count() > 0) sources.push_back({changed, &leaf});
    count += uint64_t(changed.count());
  }
  std::sort(sources.begin(), sources.end(),
            [](const auto& a, const auto& b) { return lessZYX(a.changed.origin, b.changed.origin); });
  ChangedVoxels changes;
  changes.leaves.reserve(sources.size());
  std::vector<T> values;
  values.reserve(count);
  float decoded[kLeafVoxels];
  for (Source& source : sources) {
    source.changed.first = values.size();
    tree.decode(*source.leaf, decoded);
    appendChanged(source.changed, decoded, path, values);
    changes.leaves.push_back(source.changed);
  }
  changes.values = std::move(values);
  return changes;
}

// Gives access to OpenVDB's writing into a stream with offsets, which its public classes do for files only.
class MemoryArchive : public openvdb::io::Archive {
 public:
  std::string bytesOf(const openvdb::GridBase::Ptr& grid) {
    std::ostringstream out(std::ios::binary);
    const openvdb::GridCPtrVec grids{grid};
    Archive::write(out, grids, /*seekable=*/true);
    return std::move(out).str();
  }
};

// Replaces the random UUID by one made from the content, so that equal content gives equal files.
void makeReproducible(std::string& bytes) {
  constexpr size_t kUuidAt = 21;
  const std::string blank = "00000000-0000-4000-8000-000000000000";
  bytes.replace(kUuidAt, blank.size(), blank);
  const std::string digits = hexOf(xxh64(bytes));
  bytes.replace(kUuidAt, 8, digits.substr(0, 8));
  bytes.replace(kUuidAt + 24, 8, digits.substr(8));
}

bool survivesHalf(float v) {
  return sameBits(float(openvdb::math::half(v)), v);
}

openvdb::math::Transform::Ptr transformOf(const Affine& a) {
  const auto& c = a.column;
  const Vec3d& t = a.translation;
  return openvdb::math::Transform::createLinearTransform(
      openvdb::math::Mat4d(c[0].x, c[0].y, c[0].z, 0.0, c[1].x, c[1].y, c[1].z, 0.0, c[2].x, c[2].y, c[2].z,
                           0.0, t.x, t.y, t.z, 1.0));
}

openvdb::FloatGrid::Ptr emptyGrid(const Lattice& lattice, const std::string& name,
                                  const std::vector<VdbMetadataEntry>& metadata) {
  [[maybe_unused]] static const bool initialized = (openvdb::initialize(), true);
  auto grid = openvdb::FloatGrid::create(float(lattice.background));
  grid->setName(name);
  grid->setTransform(transformOf(lattice.worldFromIndex));
  for (const auto& [key, value] : metadata)
    std::visit(
        [&, k = key](const auto& v) {
          using M = std::decay_t<decltype(v)>;
          grid->insertMeta(k, openvdb::TypedMetadata<M>(v));
        },
        value);
  return grid;
}

std::string encoded(const openvdb::FloatGrid::Ptr& grid, bool half) {
  grid->setSaveFloatAsHalf(half && survivesHalf(grid->background()));
  MemoryArchive archive;
  archive.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                         (openvdb::io::Archive::hasBloscCompression() ? openvdb::io::COMPRESS_BLOSC
                                                                      : openvdb::io::COMPRESS_ZIP));
  std::string bytes = archive.bytesOf(grid);
  makeReproducible(bytes);
  return bytes;
}

}  // namespace

ElementType elementTypeOf(const VdbGridType& type) {
  return type.leaf == VdbGridType::Leaf::values ? ElementType::f32 : ElementType::u8;
}

double backgroundAs(ElementType type, double background) {
  return type == ElementType::f32 ? double(float(background)) : background;
}

Field fieldFromTree(const std::string& path, const VdbContainer& file, const VdbGridHeader& grid,
                    std::span<const char> tree, ElementType type) {
  const std::string value = grid.type() ? grid.type()->valueName : grid.typeName;
  if (value == "float") return dispatch(type, [&]<class T>() { return readFloatField<T>(path, grid, tree); });
  if (value == "double") return readField<openvdb::DoubleTree, float>(path, file, grid, tree);
  if (value == "int32") return readField<openvdb::Int32Tree, float>(path, file, grid, tree);
  if (value == "int64") return readField<openvdb::Int64Tree, float>(path, file, grid, tree);
  if (value == "bool") return readField<openvdb::BoolTree, uint8_t>(path, file, grid, tree);
  if (value == "mask") return readField<openvdb::MaskTree, uint8_t>(path, file, grid, tree);
  throw InputError(path, "grid \"" + grid.name + "\" has type " + value + ", expected a scalar type");
}

ChangedVoxels changesFromTree(const std::string& path, const VdbGridHeader& grid, std::span<const char> bytes,
                              ElementType type) {
  return guarded(path, grid, bytes, [&](const VdbTreeParts& parts) {
    VdbFloatTree tree(bytes, grid, parts);
    return dispatch(type, [&]<class T>() { return changesOf<T>(tree, path); });
  });
}

std::string vdbFromField(const Field& field, const Lattice& lattice, const std::string& gridName,
                         const std::vector<VdbMetadataEntry>& metadata) {
  const auto grid = emptyGrid(lattice, gridName, metadata);
  bool half = true;
  std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        const T background = T(field.background);
        for (size_t l = 0; l < field.leafCount(); ++l) {
          openvdb::FloatTree::LeafNodeType* leaf = nullptr;
          for (int i = 0; i < kLeafVoxels; ++i) {
            const T v = values[l * kLeafVoxels + size_t(i)];
            if (sameBits(v, background)) continue;
            if (!leaf) leaf = grid->tree().touchLeaf(toCoord(field.leafOrigins[l]));
            leaf->setValueOn(openvdb::Index(vdbOffsetOf(i)), float(v));
            half = half && survivesHalf(float(v));
          }
        }
      },
      field.values);
  return encoded(grid, half);
}

std::string vdbFromChanges(const ChangedVoxels& changes, const Lattice& lattice, const std::string& gridName,
                           const std::vector<VdbMetadataEntry>& metadata) {
  const auto grid = emptyGrid(lattice, gridName, metadata);
  bool half = true;
  std::visit(
      [&](const auto& values) {
        for (const ChangedLeaf& changed : changes.leaves) {
          auto* leaf = grid->tree().touchLeaf(toCoord(changed.origin));
          size_t next = changed.first;
          for (int z = 0; z < 8; ++z)
            for (uint64_t word = changed.mask[size_t(z)]; word != 0; word &= word - 1) {
              const auto v = float(values[next++]);
              leaf->setValueOn(openvdb::Index(vdbOffsetOf(64 * z + std::countr_zero(word))), v);
              half = half && survivesHalf(v);
            }
        }
      },
      changes.values);
  return encoded(grid, half);
}

}  // namespace kairos
