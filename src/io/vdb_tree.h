// Decoding the nodes of a tree straight from a file's bytes, each leaf once and into its place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/vdb_container.h"
#include "io/vdb_leaf_order.h"

namespace kairos {

/// The nodes of a tree with values of type V: float or double (stored as such, or as halves), int32_t,
/// int64_t, or uint8_t (0 and 1) for boolean and mask trees. Keeps references.
template <class V>
class VdbTree {
 public:
  struct Tile {
    Vec3i origin;
    int edge;  // voxels
    V value;
    bool active;
  };

  /// `tree` are the bytes [grid.treeBegin, grid.end) of the file; `parts` what checkTree found in them.
  VdbTree(std::span<const char> tree, const VdbGridHeader& grid, const VdbTreeParts& parts);

  V background() const { return background_; }
  const std::vector<VdbTreeParts::Leaf>& leaves() const { return parts_.leaves; }
  VdbLeafMask activeVoxels(const VdbTreeParts::Leaf& leaf) const;
  /// All 512 values, active or not, in OpenVDB's order. Throws std::runtime_error when they cannot be
  /// decompressed.
  void decode(const VdbTreeParts::Leaf& leaf, V* values);
  /// Tiles of every level that are active or differ from the background.
  std::vector<Tile> tiles();

 private:
  const char* at(uint64_t position) const { return tree_.data() + (position - grid_.treeBegin); }
  void values(const char* p, const uint64_t* active, size_t count, V* out);
  const char* stored(const char* p, size_t count);
  void load(const char* bytes, size_t count, V* out);
  void addTilesOf(const VdbTreeParts::InternalNode& node, std::vector<Tile>& tiles);

  std::span<const char> tree_;
  const VdbGridHeader& grid_;
  const VdbTreeParts& parts_;
  bool halves_;
  V background_;
  std::vector<char> decompressed_;
  std::vector<float> floats_;
  std::vector<V> packed_, nodeValues_;
};

}  // namespace kairos
