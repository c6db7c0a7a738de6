#include "diff/influence_map.h"

#include <algorithm>
#include <bit>

namespace kairos {
namespace {

constexpr int kLeastBandRows = 16;
constexpr size_t kLeavesPerTask = 256;

template <class Visit>
void forEachChangedVoxel(const ChangedLeaf& leaf, Visit&& visit) {
  for (int z = 0; z < kLeafEdge; ++z)
    for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1) {
      const int offset = std::countr_zero(word);
      visit(leaf.origin + Vec3i{offset & 7, offset >> 3, z});
    }
}

}  // namespace

InfluenceMap::InfluenceMap(const VoxelProjection& projection, ThreadPool& pool)
    : projection_(projection),
      pool_(pool),
      stride_(projection.width() + 1),
      differences_(size_t(stride_) * size_t(projection.height())),
      numbers_(size_t(projection.width()) * size_t(projection.height())) {
  const int wanted = pool.threads() == 1 ? 1 : 2 * pool.threads(), h = projection.height();
  const int count = std::clamp(h / kLeastBandRows, 1, wanted);
  for (int b = 0; b < count; ++b)
    bands_.push_back({int(int64_t(h) * b / count), int(int64_t(h) * (b + 1) / count)});
}

void InfluenceMap::clear() {
  std::fill(differences_.begin(), differences_.end(), 0);
  std::fill(numbers_.begin(), numbers_.end(), 0);
}

void InfluenceMap::accumulate(std::span<const ChangedLeaf> voxels, int32_t sign) {
  leafRows_.resize(voxels.size());
  pool_.forEach(voxels.size(), kLeavesPerTask, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const PixelRectangle r = projection_.rectangleOfCube(voxels[i].origin, kLeafEdge);
      leafRows_[i] = r.empty() ? Rows{0, -1} : Rows{r.y0, r.y1};
    }
  });
  pool_.forEach(bands_.size(), 1, [&](size_t begin, size_t end) {
    PixelRows rows(projection_.height());
    for (size_t b = begin; b < end; ++b)
      for (size_t i = 0; i < voxels.size(); ++i)
        if (leafRows_[i].last >= bands_[b].begin && leafRows_[i].first < bands_[b].end)
          accumulateLeaf(voxels[i], bands_[b], sign, rows);
  });
}

void InfluenceMap::accumulateLeaf(const ChangedLeaf& leaf, const Band& band, int32_t sign, PixelRows& rows) {
  if (projection_.rectangular())
    forEachChangedVoxel(leaf, [&](const Vec3i& v) { addRectangle(projection_.rectangle(v), band, sign); });
  else
    forEachChangedVoxel(leaf, [&](const Vec3i& v) {
      projection_.project(v, rows);
      addRows(rows, band, sign);
    });
}

void InfluenceMap::addRectangle(const PixelRectangle& j, const Band& band, int32_t sign) {
  const int top = std::max(j.y0, band.begin), below = j.y1 + 1;
  if (j.x1 < j.x0 || top >= std::min(below, band.end)) return;
  int32_t* row = differences(top);
  row[j.x0] += sign;
  row[j.x1 + 1] -= sign;
  if (below >= band.end) return;
  row = differences(below);
  row[j.x0] -= sign;
  row[j.x1 + 1] += sign;
}

void InfluenceMap::addRows(const PixelRows& j, const Band& band, int32_t sign) {
  const int last = std::min(j.bottom, band.end - 1);
  for (int y = std::max(j.top, band.begin); y <= last; ++y) {
    if (j.last[size_t(y)] < j.first[size_t(y)]) continue;
    int32_t* row = differences(y);
    row[j.first[size_t(y)]] += sign;
    row[j.last[size_t(y)] + 1] -= sign;
  }
}

void InfluenceMap::refresh() {
  const int width = projection_.width();
  const bool columns = projection_.rectangular();
  pool_.forEach(bands_.size(), 1, [&](size_t begin, size_t end) {
    for (size_t b = begin; b < end; ++b)
      for (int y = bands_[b].begin; y < bands_[b].end; ++y) {
        const int32_t* row = differences(y);
        int32_t* out = numbers_.data() + size_t(y) * size_t(width);
        const int32_t* above = columns && y > bands_[b].begin ? out - width : nullptr;
        int32_t run = 0;
        for (int x = 0; x < width; ++x) {
          run += row[x];
          out[x] = above ? above[x] + run : run;
        }
      }
  });
}

Image imageOf(std::span<const int32_t> numbers, int width, int height) {
  Image image(width, height, 1);
  std::transform(numbers.begin(), numbers.end(), image.data.begin(), [](int32_t n) { return float(n); });
  return image;
}

std::vector<uint64_t> influenceHistogram(std::span<const int32_t> numbers) {
  const auto most = std::max_element(numbers.begin(), numbers.end());
  std::vector<uint64_t> histogram(most == numbers.end() ? 1 : size_t(*most) + 1);
  for (const int32_t n : numbers) ++histogram[size_t(n)];
  return histogram;
}

}  // namespace kairos
