#include "tcdvrm/change_magnitude.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kairos {
namespace {

// The value a voxel is rendered with.
template <class T>
double rendered(T value, double background) {
  return std::isfinite(double(value)) ? double(value) : background;
}

template <class T>
double valueAt(const BrickVolume& volume, const Vec3i& voxel) {
  const Vec3i p = voxel - volume.gridOrigin();
  const uint32_t cell = volume.cellIndex({p.x / kBrickEdge, p.y / kBrickEdge, p.z / kBrickEdge});
  const int x = p.x % kBrickEdge, y = p.y % kBrickEdge, z = p.z % kBrickEdge;
  return double(volume.brick<T>(cell)[(z * kBrickStride + y) * kBrickStride + x]);
}

template <class T>
void leafMagnitudes(const BrickVolume& volume, const ChangedLeaf& leaf, const T* values, float* magnitudes) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1, ++values, ++magnitudes) {
      const int offset = std::countr_zero(word);
      const Vec3i voxel = leaf.origin + Vec3i{offset & 7, offset >> 3, z};
      if (!volume.lattice().domain.contains(voxel)) continue;
      const double difference = rendered(*values, volume.background()) - valueAt<T>(volume, voxel);
      *magnitudes = float(std::min(std::abs(difference), double(std::numeric_limits<float>::max())));
    }
}

}  // namespace

std::vector<float> changeMagnitudes(const BrickVolume& volume, const ChangedVoxels& changes,
                                    ThreadPool& pool) {
  std::vector<float> magnitudes(changes.count());
  if (changes.type() != volume.lattice().type) return magnitudes;
  dispatch(changes.type(), [&]<class T>() {
    const auto& values = valuesAs<T>(changes.values);
    pool.forEach(changes.leaves.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const ChangedLeaf& leaf = changes.leaves[i];
        leafMagnitudes<T>(volume, leaf, values.data() + leaf.first, magnitudes.data() + leaf.first);
      }
    });
  });
  return magnitudes;
}

std::vector<uint16_t> samplingWeights(const std::vector<float>& magnitudes) {
  std::vector<uint16_t> weights(magnitudes.size(), 1);
  const auto largest = std::max_element(magnitudes.begin(), magnitudes.end());
  if (largest == magnitudes.end() || !(*largest > 0)) return weights;
  const double scale = 65535 / double(*largest);
  for (size_t i = 0; i < weights.size(); ++i)
    weights[i] = uint16_t(std::max(1.0, std::round(magnitudes[i] * scale)));
  return weights;
}

}  // namespace kairos
