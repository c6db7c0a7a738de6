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
    checkTree(reader, grid);
    if (reader.remaining() != 0)
      reader.fail("is damaged: the tree of grid \"" + grid.name + "\" ends before its block");
    return body();
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

// What fills one of our leaves: a leaf of the tree, or a part of a tile.
template <class TreeT>
struct Block {
  Vec3i origin;
  const typename TreeT::LeafNodeType* leaf;
  typename TreeT::ValueType tile;
};

template <class TreeT, class T>
class BlockList {
 public:
  using LeafT = typename TreeT::LeafNodeType;
  using V = typename TreeT::ValueType;

  BlockList(const TreeT& tree, T background, const std::string& path) : path_(path), background_(background) {
    visit(tree.root());
    std::sort(blocks_.begin(), blocks_.end(),
              [](const auto& a, const auto& b) { return lessZYX(a.origin, b.origin); });
  }
  const std::vector<Block<TreeT>>& blocks() const { return blocks_; }

 private:
  template <class Node>
  void visit(const Node& node) {
    for (auto it = node.cbeginValueAll(); it; ++it)
      addTile(it.getCoord(), int(Node::ChildNodeType::DIM), it.getValue());
    for (auto it = node.cbeginChildOn(); it; ++it) {
      if constexpr (std::is_same_v<typename Node::ChildNodeType, LeafT>)
        add({toVec(it->origin()), &*it, V()});
      else
        visit(*it);
    }
  }

  void addTile(const openvdb::Coord& origin, int edge, V value) {
    const T v = converted<T>(value, path_);
    if (sameBits(v, background_) || v == background_) return;  // -0 as a tile is as good as 0
    const uint64_t leaves =
        uint64_t(edge / kLeafEdge) * uint64_t(edge / kLeafEdge) * uint64_t(edge / kLeafEdge);
    require(leaves);
    for (int z = 0; z < edge; z += kLeafEdge)
      for (int y = 0; y < edge; y += kLeafEdge)
        for (int x = 0; x < edge; x += kLeafEdge) add({toVec(origin) + Vec3i{x, y, z}, nullptr, value});
  }

  void add(const Block<TreeT>& block) {
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
  std::vector<Block<TreeT>> blocks_;
};

template <class TreeT, class T>
void copyBlock(const Block<TreeT>& block, T* out, const std::string& path) {
  if (!block.leaf) {
    std::fill_n(out, kLeafVoxels, converted<T>(block.tile, path));
    return;
  }
  for (int i = 0; i < kLeafVoxels; ++i)
    out[i] = converted<T>(block.leaf->getValue(openvdb::Index(vdbOffsetOf(i))), path);
}

// Grows `bounds` by the voxels of a leaf that differ from the background; false when there are none.
template <class T>
bool growBounds(const Vec3i& origin, const T* values, T background, VoxelBox& bounds) {
  const VoxelBox whole{origin, origin + Vec3i{kLeafEdge, kLeafEdge, kLeafEdge}};
  const bool inside = !bounds.empty() && bounds.contains(whole);
  bool any = false;
  for (int i = 0; i < kLeafVoxels; ++i) {
    if (sameBits(values[i], background)) continue;
    any = true;
    if (inside) break;
    const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
    bounds = unite(bounds, {v, v + Vec3i{1, 1, 1}});
  }
  return any;
}

template <class TreeT, class T>
Field fieldOf(const TreeT& tree, const std::string& path) {
  const T background = converted<T>(tree.background(), path);
  const BlockList<TreeT, T> list(tree, background, path);
  Field field;
  field.background = double(background);
  std::vector<T> values(list.blocks().size() * kLeafVoxels);
  size_t kept = 0;
  for (const Block<TreeT>& block : list.blocks()) {
    T* out = values.data() + kept * kLeafVoxels;
    copyBlock(block, out, path);
    if (!growBounds(block.origin, out, background, field.bounds)) continue;
    field.leafOrigins.push_back(block.origin);
    ++kept;
  }
  values.resize(kept * kLeafVoxels);
  field.values = std::move(values);
  return field;
}

template <class TreeT, class T>
Field readField(const std::string& path, const VdbContainer& file, const VdbGridHeader& grid,
                std::span<const char> bytes) {
  return guarded(path, grid, bytes, [&] {
    TreeT tree;
    readTree(tree, file, grid, bytes);
    return fieldOf<TreeT, T>(tree, path);
  });
}

ChangedLeaf changedLeafOf(const openvdb::FloatTree::LeafNodeType& leaf) {
  ChangedLeaf changed{toVec(leaf.origin()), {}, 0};
  for (int i = 0; i < kLeafVoxels; ++i)
    if (leaf.isValueOn(openvdb::Index(vdbOffsetOf(i))))
      changed.mask[size_t(i / 64)] |= uint64_t(1) << (i % 64);
  return changed;
}

template <class T>
ChangedVoxels changesOf(const openvdb::FloatTree& tree, const std::string& path) {
  if (tree.activeTileCount() > 0)
    throw InputError(path, "holds active tiles; a differential file has single voxels only");
  std::vector<std::pair<ChangedLeaf, const openvdb::FloatTree::LeafNodeType*>> leaves;
  for (auto it = tree.cbeginLeaf(); it; ++it)
    if (!it->isEmpty()) leaves.emplace_back(changedLeafOf(*it), &*it);
  std::sort(leaves.begin(), leaves.end(),
            [](const auto& a, const auto& b) { return lessZYX(a.first.origin, b.first.origin); });
  ChangedVoxels changes;
  std::vector<T> values;
  values.reserve(size_t(tree.activeVoxelCount()));
  for (auto& [changed, leaf] : leaves) {
    changed.first = values.size();
    for (int z = 0; z < 8; ++z)
      for (uint64_t word = changed.mask[size_t(z)]; word != 0; word &= word - 1) {
        const int offset = vdbOffsetOf(64 * z + std::countr_zero(word));
        values.push_back(converted<T>(leaf->getValue(openvdb::Index(offset)), path));
      }
    changes.leaves.push_back(changed);
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
  if (value == "float")
    return dispatch(type,
                    [&]<class T>() { return readField<openvdb::FloatTree, T>(path, file, grid, tree); });
  if (value == "double") return readField<openvdb::DoubleTree, float>(path, file, grid, tree);
  if (value == "int32") return readField<openvdb::Int32Tree, float>(path, file, grid, tree);
  if (value == "int64") return readField<openvdb::Int64Tree, float>(path, file, grid, tree);
  if (value == "bool") return readField<openvdb::BoolTree, uint8_t>(path, file, grid, tree);
  if (value == "mask") return readField<openvdb::MaskTree, uint8_t>(path, file, grid, tree);
  throw InputError(path, "grid \"" + grid.name + "\" has type " + value + ", expected a scalar type");
}

ChangedVoxels changesFromTree(const std::string& path, const VdbContainer& file, const VdbGridHeader& grid,
                              std::span<const char> bytes, ElementType type) {
  return guarded(path, grid, bytes, [&] {
    openvdb::FloatTree tree;
    readTree(tree, file, grid, bytes);
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
