// A volume as the LOD renderer keeps it: its levels, its octree and its subvolumes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/transfer_function.h"
#include "lod/scalar_pyramid.h"
#include "lod/subdivision.h"
#include "lod/value_octree.h"

namespace kairos {

/// What takes time to compute about a volume and can be kept for the next run.
struct LodHierarchy {
  std::vector<float> coarse;          // ScalarPyramid::coarseValues
  std::vector<NodeStatistics> nodes;  // ValueOctree::all
};

class LodVolume {
 public:
  /// `stored`, if any, is the hierarchy of an equal field; throws StateError where it cannot be.
  LodVolume(const Lattice& lattice, const Field& field, const SubdivisionOptions& options, ThreadPool& pool,
            const LodHierarchy* stored = nullptr);

  const Lattice& lattice() const { return lattice_; }
  const ScalarPyramid& pyramid() const { return pyramid_; }
  const ValueOctree& octree() const { return octree_; }
  const Subdivision& subdivision() const { return subdivision_; }
  LodHierarchy hierarchy() const { return {pyramid_.coarseValues(), octree_.all()}; }

  /// Smallest and largest value a subvolume's finest level holds, faces included.
  ValueRange range(uint32_t i) const { return ranges_[i]; }
  /// Root mean square of what a subvolume loses at a level, in the values' units.
  double deviation(uint32_t i, int level) const { return deviations_[i][size_t(level)]; }

  /// Takes over changed voxels; the division into subvolumes stays. The result is valid until the next call.
  const DirtyBlocks& apply(const ChangedVoxels& changes);
  /// Subvolumes whose finest level the last `apply` changed, ascending.
  const std::vector<uint32_t>& dirtySubvolumes() const { return dirty_; }

 private:
  void measure(uint32_t i);

  Lattice lattice_;
  ScalarPyramid pyramid_;
  ValueOctree octree_;
  Subdivision subdivision_;
  std::vector<ValueRange> ranges_;
  std::vector<std::vector<double>> deviations_;
  std::vector<uint32_t> dirty_;
};

/// The vertices of one of a subvolume's levels that lie in these blocks, as a box counted from its first;
/// empty where none does.
VoxelBox dirtyVertices(const Subvolume& subvolume, int level, const std::vector<Vec3i>& blocks);

}  // namespace kairos
