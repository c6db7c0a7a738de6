#include "io/vdb_writer.h"

#include <blosc.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>

#include "io/file_bytes.h"
#include "io/half_rows.h"
#include "io/vdb_leaf_order.h"
#include "io/vdb_node_codes.h"

namespace kairos {
namespace {

// The active voxels of a tree of configuration 5-4-3; leaves in its order, values in the leaves' order.
struct ActiveVoxels {
  struct Leaf {
    Vec3i origin;
    VdbLeafMask mask;
    size_t first, count;  // of `values`
  };
  std::vector<Leaf> leaves;
  std::vector<float> values;
  VoxelBox bounds;

  explicit ActiveVoxels(uint64_t atMost) { values.resize(atMost); }

  void add(const Vec3i& origin, const VdbLeafMask& mask, const float* leafValues) {
    float* begin = values.data() + used_;
    const auto count = size_t(packRows(mask, leafValues, begin) - begin);
    if (count == 0) return;
    leaves.push_back({origin, mask, used_, count});
    bounds = unite(bounds, boundsOf(leaves.back()));
    used_ += count;
  }
  void end() { values.resize(used_); }

 private:
  static VoxelBox boundsOf(const Leaf& leaf) {
    VoxelBox box{{kLeafEdge, kLeafEdge, kLeafEdge}, {0, 0, 0}};
    for (int x = 0; x < kLeafEdge; ++x)
      for (int y = 0; y < kLeafEdge; ++y) {
        const auto row = uint8_t(leaf.mask[size_t(x)] >> (8 * y));
        if (row == 0) continue;
        box.lo = componentMin(box.lo, {x, y, std::countr_zero(row)});
        box.hi = componentMax(box.hi, {x + 1, y + 1, int(std::bit_width(row))});
      }
    return {leaf.origin + box.lo, leaf.origin + box.hi};
  }

  size_t used_ = 0;
};

constexpr int kUpperEdge = 32, kLowerEdge = 16;
constexpr int kLowerSpan = kLowerEdge * kLeafEdge, kUpperSpan = kUpperEdge * kLowerSpan;

Vec3i nodeOrigin(const Vec3i& v, int span) {
  return {v.x & -span, v.y & -span, v.z & -span};  // spans are powers of two
}

// Indices of leaves in the order in which a tree keeps them.
template <class OriginOf>
std::vector<size_t> treeOrder(size_t count, OriginOf&& originOf) {
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i;
  const auto key = [](const Vec3i& v, int span) {
    const Vec3i node = nodeOrigin(v, span);
    return std::tuple(node.x, node.y, node.z);
  };
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    const Vec3i &va = originOf(a), &vb = originOf(b);
    return std::tuple(key(va, kUpperSpan), key(va, kLowerSpan), key(va, kLeafEdge)) <
           std::tuple(key(vb, kUpperSpan), key(vb, kLowerSpan), key(vb, kLeafEdge));
  });
  return order;
}

ActiveVoxels activeOf(const Field& field) {
  ActiveVoxels active(field.leafCount() * kLeafVoxels);
  std::visit(
      [&](const auto& all) {
        using T = typename std::decay_t<decltype(all)>::value_type;
        const auto background = bitsOf(T(field.background));
        VdbLeafMask everything;
        everything.fill(~uint64_t(0));
        float values[kVdbLeafVoxels];
        for (size_t l : treeOrder(field.leafCount(), [&](size_t i) { return field.leafOrigins[i]; })) {
          const T* leaf = all.data() + l * kLeafVoxels;
          VdbLeafMask mask{};
          for (size_t i = 0; i < size_t(kLeafVoxels); ++i)
            mask[i / 64] |= uint64_t(bitsOf(leaf[i]) != background) << (i % 64);
          placeInVdbOrder(everything, leaf, values);
          active.add(field.leafOrigins[l], reorderedMask(mask), values);
        }
      },
      field.values);
  active.end();
  return active;
}

ActiveVoxels activeOf(const ChangedVoxels& changes) {
  ActiveVoxels active(changes.count());
  std::visit(
      [&](const auto& all) {
        float values[kVdbLeafVoxels];
        for (size_t l :
             treeOrder(changes.leaves.size(), [&](size_t i) { return changes.leaves[i].origin; })) {
          const ChangedLeaf& leaf = changes.leaves[l];
          placeInVdbOrder(leaf.mask, all.data() + leaf.first, values);
          active.add(leaf.origin, reorderedMask(leaf.mask), values);
        }
      },
      changes.values);
  active.end();
  return active;
}

// Can all of them be stored as halves, bit for bit?
bool surviveHalf(const std::vector<float>& values, float background) {
  constexpr size_t kAtOnce = 512;
  half halves[kAtOnce];
  float back[kAtOnce];
  const auto survive = [&](const float* v, size_t count) {
    toHalves(v, count, halves);
    toFloats(reinterpret_cast<const char*>(halves), count, back);
    return std::memcmp(v, back, count * sizeof(float)) == 0;
  };
  for (size_t i = 0; i < values.size(); i += kAtOnce)
    if (!survive(values.data() + i, std::min(kAtOnce, values.size() - i))) return false;
  return survive(&background, 1);
}

// Bytes as OpenVDB's streams write them.
class Bytes {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const void* bytes, size_t count) { text_.append(static_cast<const char*>(bytes), count); }
  void putString(const std::string& text) {
    put(uint32_t(text.size()));
    text_ += text;
  }
  size_t position() const { return text_.size(); }
  void replace(size_t at, const void* bytes, size_t count) {
    text_.replace(at, count, static_cast<const char*>(bytes), count);
  }
  std::string& text() { return text_; }
  void reserve(size_t bytes) { text_.reserve(bytes); }

 private:
  std::string text_;
};

// The tree's topology, then the values of its leaves.
class TreeWriter {
 public:
  TreeWriter(const ActiveVoxels& active, float background, bool asHalf, Bytes& out)
      : leaves_(active.leaves), values_(active.values), background_(background), half_(asHalf), out_(out) {}

  void putTopology() {
    out_.put(int32_t(1));  // buffers a leaf
    out_.put(background_);
    out_.put(uint32_t(0));  // tiles of the root
    uint32_t children = 0;
    forEachNode(0, leaves_.size(), kUpperSpan, [&](size_t, size_t) { ++children; });
    out_.put(children);
    forEachNode(0, leaves_.size(), kUpperSpan, [&](size_t begin, size_t end) {
      out_.put(nodeOrigin(leaves_[begin].origin, kUpperSpan));
      putInternalNode(begin, end, kUpperEdge, kLowerSpan);
    });
  }

  void putBuffers() {
    for (const ActiveVoxels::Leaf& leaf : leaves_) {
      out_.put(leaf.mask);
      putValues(values_.data() + leaf.first, leaf.count);
    }
  }

 private:
  // Calls `body(begin, end)` for the leaves of each node of this span.
  template <class Body>
  void forEachNode(size_t begin, size_t end, int span, Body&& body) const {
    while (begin < end) {
      const Vec3i origin = nodeOrigin(leaves_[begin].origin, span);
      size_t next = begin + 1;
      while (next < end && nodeOrigin(leaves_[next].origin, span) == origin) ++next;
      body(begin, next);
      begin = next;
    }
  }

  // Leaves [begin, end) stand in this node, whose children span `childSpan` voxels: masks of its children and
  // of its active tiles, the values of these (there are none), and the children.
  void putInternalNode(size_t begin, size_t end, int edge, int childSpan) {
    std::vector<uint64_t> masks(2 * size_t(edge) * size_t(edge) * size_t(edge) / 64);
    const Vec3i origin = nodeOrigin(leaves_[begin].origin, edge * childSpan);
    forEachNode(begin, end, childSpan, [&](size_t first, size_t) {
      const Vec3i v = leaves_[first].origin - origin;
      const auto i = size_t((v.x / childSpan * edge + v.y / childSpan) * edge + v.z / childSpan);
      masks[i / 64] |= uint64_t(1) << (i % 64);
    });
    out_.put(masks.data(), masks.size() * sizeof(uint64_t));
    putValues(nullptr, 0);
    forEachNode(begin, end, childSpan, [&](size_t first, size_t last) {
      if (edge == kUpperEdge)
        putInternalNode(first, last, kLowerEdge, kLeafEdge);
      else
        out_.put(leaves_[first].mask);
    });
  }

  // Active values; the inactive ones are the background.
  void putValues(const float* values, size_t count) {
    out_.put(int8_t(kBackground));
    if (!half_) return putBlock(values, sizeof(float), count);
    if (count == 0) return;
    half halves[kVdbLeafVoxels];
    toHalves(values, count, halves);
    putBlock(halves, sizeof(half), count);
  }

  // Compressed, behind its size; or as it is, behind its negative size (OpenVDB's bloscToStream).
  void putBlock(const void* values, size_t valueBytes, size_t count) {
    constexpr int kLevel = 9, kShuffle = 1, kThreads = 1;
    const size_t bytes = valueBytes * count;
    char packed[sizeof(float) * kVdbLeafVoxels + BLOSC_MAX_OVERHEAD];
    const int size = blosc_compress_ctx(kLevel, kShuffle, valueBytes, bytes, values, packed,
                                        bytes + BLOSC_MAX_OVERHEAD, BLOSC_LZ4_COMPNAME, bytes, kThreads);
    out_.put(size > 0 ? int64_t(size) : -int64_t(bytes));
    out_.put(size > 0 ? packed : values, size > 0 ? size_t(size) : bytes);
  }

  const std::vector<ActiveVoxels::Leaf>& leaves_;
  const std::vector<float>& values_;
  float background_;
  bool half_;
  Bytes& out_;
};

// Name, type and bytes of each entry, in the order of the names.
class MetadataMap {
 public:
  void add(const std::string& name, const std::string& text) { entries_[name] = {"string", text}; }
  void add(const std::string& name, int64_t value) { addPlain(name, "int64", value); }
  void add(const std::string& name, double value) { addPlain(name, "double", value); }
  void add(const std::string& name, bool value) { addPlain(name, "bool", char(value)); }
  void add(const std::string& name, const Vec3i& value) { addPlain(name, "vec3i", value); }

  void putTo(Bytes& out) const {
    out.put(uint32_t(entries_.size()));
    for (const auto& [name, entry] : entries_) {
      out.putString(name);
      out.putString(entry.type);
      out.putString(entry.bytes);
    }
  }

 private:
  struct Entry {
    std::string type, bytes;
  };
  template <class T>
  void addPlain(const std::string& name, const char* type, const T& value) {
    entries_[name] = {type, std::string(reinterpret_cast<const char*>(&value), sizeof value)};
  }
  std::map<std::string, Entry> entries_;
};

MetadataMap metadataOf(const ActiveVoxels& active, const std::string& gridName, bool half,
                       const std::vector<VdbMetadataEntry>& more) {
  MetadataMap metadata;
  constexpr int kMax = std::numeric_limits<int>::max(), kMin = std::numeric_limits<int>::min();
  const bool empty = active.bounds.empty();
  metadata.add("name", gridName);
  metadata.add("file_bbox_min", empty ? Vec3i{kMax, kMax, kMax} : active.bounds.lo);
  metadata.add("file_bbox_max", empty ? Vec3i{kMin, kMin, kMin} : active.bounds.hi - Vec3i{1, 1, 1});
  metadata.add("file_voxel_count", int64_t(active.values.size()));
  metadata.add("file_compression", std::string("blosc + active values"));
  if (half) metadata.add("is_saved_as_half_float", true);
  for (const auto& [name, value] : more)
    std::visit([&, key = name](const auto& v) { metadata.add(key, v); }, value);
  return metadata;
}

bool isDiagonal(const Affine& a) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      if (r != c && a.column[size_t(c)][r] != 0) return false;
  return true;
}

// The simplest of OpenVDB's maps that is this transform.
void putTransform(const Affine& a, Bytes& out) {
  const auto& c = a.column;
  const Vec3d& t = a.translation;
  if (!isDiagonal(a)) {
    out.putString("AffineMap");
    out.put(std::array<double, 16>{c[0].x, c[0].y, c[0].z, 0, c[1].x, c[1].y, c[1].z, 0, c[2].x, c[2].y,
                                   c[2].z, 0, t.x, t.y, t.z, 1});
    return;
  }
  const Vec3d scale{c[0].x, c[1].y, c[2].z}, inverse{1 / scale.x, 1 / scale.y, 1 / scale.z};
  const bool moved = !(t == Vec3d{0, 0, 0}), uniform = scale.x == scale.y && scale.x == scale.z;
  out.putString(std::string(uniform ? "Uniform" : "") + (moved ? "ScaleTranslateMap" : "ScaleMap"));
  if (moved) out.put(t);
  out.put(scale);
  out.put(Vec3d{std::abs(scale.x), std::abs(scale.y), std::abs(scale.z)});  // voxel size
  out.put(inverse);
  out.put(Vec3d{inverse.x * inverse.x, inverse.y * inverse.y, inverse.z * inverse.z});
  out.put(inverse * 0.5);
}

// A UUID made from the content, so that equal content gives equal files.
constexpr size_t kUuidAt = 21;
const std::string kBlankUuid = "00000000-0000-4000-8000-000000000000";
void identify(std::string& bytes) {
  const std::string digits = hexOf(xxh64(bytes));
  bytes.replace(kUuidAt, 8, digits.substr(0, 8));
  bytes.replace(kUuidAt + 24, 8, digits.substr(8));
}

void putFileHeader(Bytes& out) {
  constexpr uint64_t kMagic = 0x56444220;
  constexpr uint32_t kFormat = 224, kLibrary[] = {10, 0};  // whose files these equal
  out.put(kMagic);
  out.put(kFormat);
  out.put(kLibrary);
  out.put(char(1));  // grids have offsets
  out.put(kBlankUuid.data(), kBlankUuid.size());
  out.put(uint32_t(0));  // no metadata of the file
  out.put(int32_t(1));   // grids
}

std::string encoded(const ActiveVoxels& active, const Lattice& lattice, const std::string& gridName,
                    const std::vector<VdbMetadataEntry>& metadata) {
  const auto background = float(lattice.background);
  const bool half = surviveHalf(active.values, background);
  Bytes out;
  constexpr size_t kOfLeaf = 2 * sizeof(VdbLeafMask) + 32, kOfNodes = 1 << 16;  // about
  out.reserve(active.values.size() * (half ? 2 : 4) + active.leaves.size() * kOfLeaf + kOfNodes);
  putFileHeader(out);
  out.putString(gridName);
  out.putString(half ? "Tree_float_5_4_3_HalfFloat" : "Tree_float_5_4_3");
  out.putString("");  // no instance of another grid
  int64_t offsets[3] = {};
  const size_t offsetsAt = out.position();
  out.put(offsets);
  offsets[0] = int64_t(out.position());
  out.put(uint32_t(kActiveMask | kBlosc));
  metadataOf(active, gridName, half, metadata).putTo(out);
  putTransform(lattice.worldFromIndex, out);
  TreeWriter tree(active, background, half, out);
  tree.putTopology();
  offsets[1] = int64_t(out.position());
  tree.putBuffers();
  offsets[2] = int64_t(out.position());
  out.replace(offsetsAt, offsets, sizeof offsets);
  identify(out.text());
  return std::move(out.text());
}

}  // namespace

std::string vdbFromField(const Field& field, const Lattice& lattice, const std::string& gridName,
                         const std::vector<VdbMetadataEntry>& metadata) {
  return encoded(activeOf(field), lattice, gridName, metadata);
}

std::string vdbFromChanges(const ChangedVoxels& changes, const Lattice& lattice, const std::string& gridName,
                           const std::vector<VdbMetadataEntry>& metadata) {
  return encoded(activeOf(changes), lattice, gridName, metadata);
}

}  // namespace kairos
