#include "io/vdb_container.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

namespace kairos {
namespace {

constexpr uint64_t kMagic = 0x56444220;  // " BDV" as the first bytes, then four zeros
constexpr uint32_t kOldestVersion = 222, kNewestVersion = 224;
constexpr char kNumberSeparator =
    '\x1e';  // between a grid's name and its number where several share the name
const std::string kHalfSuffix = "_HalfFloat";

using Leaf = VdbGridType::Leaf;
constexpr VdbGridType kGridTypes[] = {
    {"Tree_float_5_4_3", "float", 4, 2, Leaf::values, true},
    {"Tree_double_5_4_3", "double", 8, 2, Leaf::values, true},
    {"Tree_int32_5_4_3", "int32", 4, 4, Leaf::values, true},
    {"Tree_int64_5_4_3", "int64", 8, 8, Leaf::values, true},
    {"Tree_bool_5_4_3", "bool", 1, 1, Leaf::boolean, true},
    {"Tree_mask_5_4_3", "mask", 1, 1, Leaf::mask, true},
    {"Tree_vec3s_5_4_3", "vec3s", 12, 6, Leaf::values, false},
    {"Tree_vec3d_5_4_3", "vec3d", 24, 6, Leaf::values, false},
    {"Tree_vec3i_5_4_3", "vec3i", 12, 12, Leaf::values, false},
};

struct FileHeader {
  uint32_t version, major, minor;
  bool hasGridOffsets;
};

FileHeader readFileHeader(ByteReader& reader) {
  if (reader.remaining() < sizeof(uint64_t) || reader.get<uint64_t>() != kMagic)
    reader.fail("is not an OpenVDB file (its first bytes are not those of one)");
  FileHeader header{};
  header.version = reader.get<uint32_t>();
  if (header.version < kOldestVersion || header.version > kNewestVersion)
    reader.fail("has OpenVDB file format " + std::to_string(header.version) + ", expected " +
                std::to_string(kOldestVersion) + " to " + std::to_string(kNewestVersion));
  header.major = reader.get<uint32_t>();
  header.minor = reader.get<uint32_t>();
  header.hasGridOffsets = reader.get<char>() != 0;
  reader.skip(36);  // the file's UUID as text
  return header;
}

VdbMetadata readVdbMetadata(ByteReader& reader) {
  VdbMetadata metadata;
  const auto count = reader.get<uint32_t>();
  for (uint32_t i = 0; i < count; ++i) {
    const std::string name = reader.getString();
    VdbMetadata::Value value{reader.getString(), {}};
    const auto bytes = reader.get<uint32_t>();
    constexpr uint32_t kKept = 1 << 16;  // larger entries are no plain values
    if (bytes <= kKept) {
      value.bytes.resize(bytes);
      reader.read(value.bytes.data(), bytes);
    } else {
      reader.skip(bytes);
    }
    metadata.values[name] = std::move(value);
  }
  return metadata;
}

Vec3d readVec3d(ByteReader& reader) {
  const auto v = reader.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

// A 4x4 matrix for row vectors: row a is the image of axis a, the last row the translation.
std::optional<Affine> readMatrix(ByteReader& reader) {
  const auto m = reader.get<std::array<double, 16>>();
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) return std::nullopt;
  return Affine{{Vec3d{m[0], m[1], m[2]}, Vec3d{m[4], m[5], m[6]}, Vec3d{m[8], m[9], m[10]}},
                {m[12], m[13], m[14]}};
}

// Leaves `transform` empty for maps that are not affine; where the tree begins is unknown then.
void readTransform(ByteReader& reader, VdbGridHeader& grid) {
  grid.mapType = reader.getString();
  const std::string& type = grid.mapType;
  constexpr uint64_t kDerivedVectors = 4 * 3 * sizeof(double);  // that scale maps store besides the scale
  if (type == "AffineMap" || type == "UnitaryMap") {
    grid.transform = readMatrix(reader);
  } else if (type == "ScaleMap" || type == "UniformScaleMap") {
    grid.transform = Affine::scale(readVec3d(reader));
    reader.skip(kDerivedVectors);
  } else if (type == "TranslationMap") {
    grid.transform = Affine{};
    grid.transform->translation = readVec3d(reader);
  } else if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap") {
    const Vec3d translation = readVec3d(reader);
    grid.transform = Affine::scale(readVec3d(reader));
    grid.transform->translation = translation;
    reader.skip(kDerivedVectors);
  } else if (type != "NonlinearFrustumMap") {
    reader.fail("is damaged: grid \"" + grid.name + "\" has the unknown transform \"" + type.substr(0, 40) +
                "\"");
  }
}

double readBackground(ByteReader reader, const VdbGridType& type) {
  reader.skip(sizeof(uint32_t));  // the number of buffers
  const std::string_view value = type.valueName;
  if (value == "float") return reader.get<float>();
  if (value == "double") return reader.get<double>();
  if (value == "int32") return reader.get<int32_t>();
  if (value == "int64") return double(reader.get<int64_t>());
  return reader.get<uint8_t>() != 0;
}

std::string displayName(const std::string& uniqueName) {
  const size_t at = uniqueName.find(kNumberSeparator);
  return at == std::string::npos ? uniqueName
                                 : uniqueName.substr(0, at) + "[" + uniqueName.substr(at + 1) + "]";
}

VdbGridHeader readDescriptor(ByteReader& reader, std::array<int64_t, 3>& offsets) {
  VdbGridHeader grid;
  grid.uniqueName = reader.getString();
  grid.name = displayName(grid.uniqueName);
  grid.typeName = reader.getString();
  if (grid.typeName.ends_with(kHalfSuffix)) {
    grid.half = true;
    grid.typeName.resize(grid.typeName.size() - kHalfSuffix.size());
  }
  grid.instanceParent = reader.getString();
  offsets = reader.get<std::array<int64_t, 3>>();
  return grid;
}

void readGridBody(ByteReader& reader, VdbGridHeader& grid) {
  grid.compression = reader.get<uint32_t>();
  if (grid.compression > 7) reader.fail("is damaged: grid \"" + grid.name + "\" has an unknown compression");
  grid.metadata = readVdbMetadata(reader);
  readTransform(reader, grid);
  grid.treeBegin = reader.position();
  if (const VdbGridType* type = grid.type();
      type && type->scalar && grid.transform && grid.instanceParent.empty())
    grid.background = readBackground(reader, *type);
}

// Leaves the reader behind the grid. Files written to a pipe state no offsets: there the tree has to be
// walked.
VdbGridHeader readGridHeader(ByteReader& reader, bool hasOffsets) {
  std::array<int64_t, 3> offsets{};
  VdbGridHeader grid = readDescriptor(reader, offsets);
  const auto [begin, block, end] = offsets;  // of the grid, its buffers (an instance has none), and its end
  const bool ordered = end >= begin && (!grid.instanceParent.empty() || (block >= begin && block <= end));
  if (hasOffsets && (begin < int64_t(reader.position()) || !ordered))
    reader.fail("is damaged: grid \"" + grid.name.substr(0, 80) + "\" has impossible offsets");
  if (hasOffsets) reader.seek(uint64_t(begin));
  readGridBody(reader, grid);
  if (hasOffsets) {
    grid.end = uint64_t(end);
    if (grid.treeBegin > grid.end) reader.fail("is damaged: grid \"" + grid.name + "\" ends before its tree");
    reader.seek(grid.end);
  } else {
    if (!grid.type() || !grid.transform)
      reader.fail("was written as a stream and holds \"" + grid.name + "\" of type " + grid.typeName +
                  ", which cannot be skipped; write it again as a file");
    if (grid.instanceParent.empty()) checkTree(reader, grid);
    grid.end = reader.position();
  }
  return grid;
}

// An instance has metadata and a transform of its own, and the tree of its parent.
void resolveInstances(ByteReader& reader, VdbContainer& file) {
  for (VdbGridHeader& grid : file.grids) {
    if (grid.instanceParent.empty()) continue;
    const VdbGridHeader* parent = nullptr;
    for (const VdbGridHeader& other : file.grids)
      if (other.uniqueName == grid.instanceParent && other.instanceParent.empty()) parent = &other;
    if (!parent || parent->typeName != grid.typeName)
      reader.fail("is damaged: grid \"" + grid.name + "\" shares the tree of a grid that is not there");
    grid.half = parent->half;
    grid.compression = parent->compression;
    grid.treeBegin = parent->treeBegin;
    grid.end = parent->end;
    grid.background = parent->background;
  }
}

}  // namespace

const VdbGridType* findVdbGridType(const std::string& name) {
  for (const VdbGridType& type : kGridTypes)
    if (name == type.name) return &type;
  return nullptr;
}

std::optional<std::string> VdbMetadata::string(const std::string& name) const {
  const auto it = values.find(name);
  if (it == values.end() || it->second.type != "string") return std::nullopt;
  return std::string(it->second.bytes.begin(), it->second.bytes.end());
}

std::optional<int64_t> VdbMetadata::integer(const std::string& name) const {
  const auto it = values.find(name);
  if (it == values.end()) return std::nullopt;
  const auto& [type, bytes] = it->second;
  int32_t small;
  int64_t large;
  if (type == "int32" && bytes.size() == sizeof small)
    return std::memcpy(&small, bytes.data(), sizeof small), small;
  if (type == "int64" && bytes.size() == sizeof large)
    return std::memcpy(&large, bytes.data(), sizeof large), large;
  return std::nullopt;
}

std::optional<Vec3i> VdbMetadata::vector(const std::string& name) const {
  const auto it = values.find(name);
  Vec3i v;
  if (it == values.end() || it->second.type != "vec3i" || it->second.bytes.size() != sizeof v)
    return std::nullopt;
  std::memcpy(&v, it->second.bytes.data(), sizeof v);
  return v;
}

std::optional<VoxelBox> VdbGridHeader::activeBounds() const {
  const auto lo = metadata.vector("file_bbox_min"), hi = metadata.vector("file_bbox_max");
  if (!lo || !hi) return std::nullopt;
  constexpr int32_t kMax = std::numeric_limits<int32_t>::max();
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    if ((*hi)[a] < (*lo)[a]) return VoxelBox{};  // an empty grid: INT_MAX..INT_MIN
    box.lo[a] = (*lo)[a];
    box.hi[a] = (*hi)[a] == kMax ? kMax : (*hi)[a] + 1;
  }
  return box;
}

const VdbGridHeader* VdbContainer::find(const std::string& name) const {
  for (const VdbGridHeader& grid : grids)
    if (grid.name == name) return &grid;
  return nullptr;
}

std::string VdbContainer::gridList() const {
  std::string list;
  for (const VdbGridHeader& grid : grids) {
    const VdbGridType* type = grid.type();
    list += (list.empty() ? "" : ", ") + grid.name + " (" + (type ? type->valueName : grid.typeName) + ")";
  }
  return list.empty() ? "no grid" : list;
}

VdbContainer readVdbContainer(ByteReader& reader) {
  const FileHeader header = readFileHeader(reader);
  VdbContainer file{header.version, header.major, header.minor, {}};
  readVdbMetadata(reader);
  const auto count = reader.get<uint32_t>();
  std::set<std::string> names;
  for (uint32_t i = 0; i < count; ++i) {
    file.grids.push_back(readGridHeader(reader, header.hasGridOffsets));
    if (!names.insert(file.grids.back().uniqueName).second)
      reader.fail("is damaged: it holds two grids called \"" + file.grids.back().name + "\"");
  }
  resolveInstances(reader, file);
  return file;
}

}  // namespace kairos
