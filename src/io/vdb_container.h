// The container of an OpenVDB file: its grids, their metadata and transforms, read without the OpenVDB
// library.
//
// OpenVDB itself trusts the counts and sizes it finds in a file; a damaged one can make it read or write
// outside its buffers. Here everything that stands around a tree is parsed with bounds checks, `checkTree`
// walks the structure of the tree itself, and only bytes that passed are decoded (see vdb_tree.h).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/affine.h"
#include "core/box.h"
#include "io/file_bytes.h"

namespace kairos {

/// What the walker needs to know of a grid type.
struct VdbGridType {
  enum class Leaf { values, boolean, mask };
  const char* name;       // "Tree_float_5_4_3"
  const char* valueName;  // "float"
  int valueBytes, halfBytes;
  Leaf leaf;
  bool scalar;
};
/// Null for a type Kairos does not know (points, unusual tree configurations).
const VdbGridType* findVdbGridType(const std::string& name);

struct VdbMetadata {
  struct Value {
    std::string type;
    std::vector<char> bytes;
  };
  std::map<std::string, Value> values;

  std::optional<std::string> string(const std::string& name) const;
  std::optional<int64_t> integer(const std::string& name) const;  // int32, int64
  std::optional<Vec3i> vector(const std::string& name) const;     // vec3i
};

/// One grid of a file, as far as it stands outside the tree.
struct VdbGridHeader {
  std::string name;            // "density"; "density[1]" when several grids share the name
  std::string typeName;        // "Tree_float_5_4_3"
  bool half = false;           // values stored as 16-bit floats
  std::string instanceParent;  // non-empty: the tree is that of another grid
  std::string uniqueName;      // as instanceParent refers to it
  uint32_t compression = 0;
  VdbMetadata metadata;
  std::string mapType;              // "UniformScaleMap"
  std::optional<Affine> transform;  // absent for frustum maps
  uint64_t treeBegin = 0, end = 0;  // bytes of topology and buffers in the file
  double background = 0;            // scalar types only
  const VdbGridType* type() const { return findVdbGridType(typeName); }

  /// Active voxels by the metadata, half-open; empty box for an empty grid, nothing when the metadata lack
  /// it.
  std::optional<VoxelBox> activeBounds() const;
};

struct VdbContainer {
  uint32_t fileVersion = 0, libraryMajor = 0, libraryMinor = 0;
  std::vector<VdbGridHeader> grids;

  /// The grid called `name`, or null.
  const VdbGridHeader* find(const std::string& name) const;
  /// "density (float), velocity (vec3s)" for messages.
  std::string gridList() const;
};

/// Parses all grid headers. Throws InputError when the file is no OpenVDB file, too old (before format 222,
/// OpenVDB 3), or damaged.
VdbContainer readVdbContainer(ByteReader& reader);

/// Where the parts of a tree stand in its file, as absolute positions.
struct VdbTreeParts {
  struct RootTile {
    Vec3i origin;
    uint64_t value;
  };
  struct InternalNode {
    Vec3i origin;
    int edge, childSpan;  // children along an edge, and voxels along the edge of each
    uint64_t masks;       // of its children, then of its active tiles, then the tiles' values
  };
  struct Leaf {
    Vec3i origin;
    uint64_t buffer;  // its mask of active voxels, then its values
  };
  std::vector<RootTile> rootTiles;
  std::vector<InternalNode> internalNodes;
  std::vector<Leaf> leaves;
};

/// Walks the topology and buffers of a tree that starts at the reader's position, and checks every count and
/// size that a decoder relies on. Returns with the reader behind the tree. Throws InputError.
VdbTreeParts checkTree(ByteReader& reader, const VdbGridHeader& grid);

}  // namespace kairos
