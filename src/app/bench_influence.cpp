#include "app/bench_influence.h"

#include "diff/influence_map.h"

namespace kairos {

BenchHistogram influenceHistograms(const VoxelProjection& projection, ThreadPool& pool,
                                   const ChangedVoxels& changes, const Image& sampled) {
  InfluenceMap map(projection, pool);
  map.add(changes.leaves);
  map.refresh();
  BenchHistogram histogram;
  histogram.changed = influenceHistogram(map.numbers());
  histogram.cast.assign(histogram.changed.size(), 0);
  for (size_t p = 0; p < map.numbers().size(); ++p)
    if (sampled.data[p] > 0) ++histogram.cast[size_t(map.numbers()[p])];
  return histogram;
}

}  // namespace kairos
