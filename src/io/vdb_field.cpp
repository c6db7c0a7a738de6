#include "io/vdb_field.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <new>

#include "io/vdb_leaf_order.h"
#include "io/vdb_tree.h"

namespace kairos {
namespace {

constexpr uint64_t kMaxLeaves = uint64_t(1) << 26;
constexpr int32_t kFarthest = 1 << 30;  // keeps sums of coordinates inside 32 bits

// Checks the tree's structure, then runs `body`, turning whatever decoding throws into an InputError.
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
[[noreturn, gnu::cold, gnu::noinline]] void refuse(V value, const std::string& path) {
  throw InputError(path, "holds the value " + std::to_string(value) + ", expected whole numbers in [0, " +
                             std::to_string(std::numeric_limits<T>::max()) + "]");
}

// Called for every voxel: small enough to be inlined, and without std::floor, a library call on plain x86-64.
template <class T, class V>
T converted(V value, const std::string& path) {
  if constexpr (std::is_same_v<T, float> || std::is_same_v<T, V>) {
    return T(value);
  } else {
    if (value >= V(0) && value <= V(std::numeric_limits<T>::max()))
      if (const auto whole = int64_t(value); V(whole) == value) return T(whole);
    refuse<T>(value, path);
  }
}

template <class T>
bool sameBits(T a, T b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

// What fills one of our leaves: a leaf of the tree, or (null) a part of a tile.
template <class V>
struct Block {
  Vec3i origin;
  const VdbTreeParts::Leaf* leaf;
  V tile;
};

// The blocks of a tree with values of type V, for a field of type T.
template <class V, class T>
class BlockList {
 public:
  BlockList(T background, const std::string& path) : path_(path), background_(background) {}

  void addLeaf(const VdbTreeParts::Leaf& leaf) { add({leaf.origin, &leaf, V()}); }

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

  const std::vector<Block<V>>& sorted() {
    std::sort(blocks_.begin(), blocks_.end(),
              [](const auto& a, const auto& b) { return lessZYX(a.origin, b.origin); });
    return blocks_;
  }

 private:
  void add(const Block<V>& block) {
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
  std::vector<Block<V>> blocks_;
};

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

// From OpenVDB's order of a leaf's voxels to ours.
template <class V, class T>
void reorder(const V* values, T* out, const std::string& path) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (int y = 0; y < kLeafEdge; ++y)
      for (int x = 0; x < kLeafEdge; ++x)
        out[leafOffset(x, y, z)] = converted<T>(values[vdbOffset(x, y, z)], path);
}

template <class V, class T>
Field readField(const std::string& path, const VdbGridHeader& grid, std::span<const char> bytes) {
  return guarded(path, grid, bytes, [&](const VdbTreeParts& parts) {
    VdbTree<V> tree(bytes, grid, parts);
    const T background = converted<T>(tree.background(), path);
    BlockList<V, T> list(background, path);
    for (const auto& tile : tree.tiles()) list.addTile(tile.origin, tile.edge, tile.value);
    for (const VdbTreeParts::Leaf& leaf : tree.leaves()) list.addLeaf(leaf);
    V decoded[kLeafVoxels];
    return fieldOfBlocks(list, background, path, [&](const VdbTreeParts::Leaf& leaf, T* out) {
      tree.decode(leaf, decoded);
      reorder(decoded, out, path);
    });
  });
}

// The values of a leaf's changed voxels, from OpenVDB's order to ours; returns the place behind them.
template <class T>
T* putChanged(const VdbLeafMask& mask, const float* values, const std::string& path, T* out) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (int y = 0; y < kLeafEdge; ++y) {
      uint64_t row = mask[size_t(z)] >> (kLeafEdge * y) & 0xff;
      const float* from = values + vdbOffset(0, y, z);
      constexpr int kNextX = vdbOffset(1, 0, 0);
      if (row == 0xff) {
        for (int x = 0; x < kLeafEdge; ++x) *out++ = converted<T>(from[kNextX * x], path);
      } else {
        for (; row != 0; row &= row - 1) *out++ = converted<T>(from[kNextX * std::countr_zero(row)], path);
      }
    }
  return out;
}

template <class T>
ChangedVoxels changesOf(VdbTree<float>& tree, const std::string& path) {
  for (const VdbTree<float>::Tile& tile : tree.tiles())
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
  std::vector<T> values(count);
  T* next = values.data();
  float decoded[kLeafVoxels];
  for (Source& source : sources) {
    source.changed.first = uint64_t(next - values.data());
    tree.decode(*source.leaf, decoded);
    next = putChanged(source.changed.mask, decoded, path, next);
    changes.leaves.push_back(source.changed);
  }
  changes.values = std::move(values);
  return changes;
}

}  // namespace

ElementType elementTypeOf(const VdbGridType& type) {
  return type.leaf == VdbGridType::Leaf::values ? ElementType::f32 : ElementType::u8;
}

double backgroundAs(ElementType type, double background) {
  return type == ElementType::f32 ? double(float(background)) : background;
}

Field fieldFromTree(const std::string& path, const VdbGridHeader& grid, std::span<const char> tree,
                    ElementType type) {
  const std::string value = grid.type() ? grid.type()->valueName : grid.typeName;
  if (value == "float")
    return dispatch(type, [&]<class T>() { return readField<float, T>(path, grid, tree); });
  if (value == "double") return readField<double, float>(path, grid, tree);
  if (value == "int32") return readField<int32_t, float>(path, grid, tree);
  if (value == "int64") return readField<int64_t, float>(path, grid, tree);
  if (value == "bool" || value == "mask") return readField<uint8_t, uint8_t>(path, grid, tree);
  throw InputError(path, "grid \"" + grid.name + "\" has type " + value + ", expected a scalar type");
}

ChangedVoxels changesFromTree(const std::string& path, const VdbGridHeader& grid, std::span<const char> bytes,
                              ElementType type) {
  return guarded(path, grid, bytes, [&](const VdbTreeParts& parts) {
    VdbTree<float> tree(bytes, grid, parts);
    return dispatch(type, [&]<class T>() { return changesOf<T>(tree, path); });
  });
}

}  // namespace kairos
