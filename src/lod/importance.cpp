#include "lod/importance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace kairos {

Importance perSubvolume(SubvolumeImportance function) {
  return [f = std::move(function)](std::span<const SubvolumeView> views, std::span<double> importances) {
    std::transform(views.begin(), views.end(), importances.begin(), f);
  };
}

Importance uniformImportance() {
  return perSubvolume([](const SubvolumeView&) { return 1.0; });
}

Importance opacityImportance() {
  return perSubvolume([](const SubvolumeView& v) { return v.maxOpacity; });
}

Importance distanceImportance() {
  return perSubvolume(
      [](const SubvolumeView& v) { return 1 / std::max(v.distance, std::numeric_limits<double>::min()); });
}

Importance areaImportance() {
  return perSubvolume([](const SubvolumeView& v) { return v.projectedArea; });
}

Importance gazeImportance(double x, double y, double radius) {
  return perSubvolume([=](const SubvolumeView& v) {
    const double g = std::hypot(v.x - x, v.y - y) / radius;
    return 1 / (1 + g * g);
  });
}

Importance mixedImportance(std::vector<WeightedImportance> parts) {
  return [parts = std::move(parts)](std::span<const SubvolumeView> views, std::span<double> importances) {
    std::fill(importances.begin(), importances.end(), 0.0);
    std::vector<double> part(views.size());
    for (const WeightedImportance& p : parts) {
      p.importance(views, part);
      const double sum = std::accumulate(part.begin(), part.end(), 0.0);
      if (!(sum > 0)) continue;
      for (size_t i = 0; i < part.size(); ++i) importances[i] += p.weight * part[i] / sum;
    }
  };
}

}  // namespace kairos
