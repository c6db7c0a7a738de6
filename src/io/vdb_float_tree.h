// Decoding the nodes of a float tree straight from a file's bytes, each leaf once and into its place.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "io/vdb_container.h"

namespace kairos {

/// Bit or value number i of a leaf belongs to voxel (i / 64, i / 8 % 8, i % 8): OpenVDB's order.
inline constexpr int kVdbLeafVoxels = 512;
using VdbLeafMask = std::array<uint64_t, kVdbLeafVoxels / 64>;

/// The nodes of a tree whose values are floats (stored as such, or as halves). Keeps references.
class VdbFloatTree {
 public:
  struct Tile {
    Vec3i origin;
    int edge;  // voxels
    float value;
    bool active;
  };

  /// `tree` are the bytes [grid.treeBegin, grid.end) of the file; `parts` what checkTree found in them.
  VdbFloatTree(std::span<const char> tree, const VdbGridHeader& grid, const VdbTreeParts& parts)
      : tree_(tree), grid_(grid), parts_(parts) {}

  float background() const;
  const std::vector<VdbTreeParts::Leaf>& leaves() const { return parts_.leaves; }
  VdbLeafMask activeVoxels(const VdbTreeParts::Leaf& leaf) const;
  /// All 512 values, active or not, in OpenVDB's order. Throws std::runtime_error when they cannot be
  /// decompressed.
  void decode(const VdbTreeParts::Leaf& leaf, float* values);
  /// Tiles of every level that are active or differ from the background.
  std::vector<Tile> tiles();

 private:
  const char* at(uint64_t position) const { return tree_.data() + (position - grid_.treeBegin); }
  void values(const char* p, const uint64_t* active, size_t count, float* out);
  const char* stored(const char* p, size_t count);
  void addTilesOf(const VdbTreeParts::InternalNode& node, std::vector<Tile>& tiles);

  std::span<const char> tree_;
  const VdbGridHeader& grid_;
  const VdbTreeParts& parts_;
  std::vector<char> decompressed_;
  std::vector<float> packed_, nodeValues_;
};

}  // namespace kairos
