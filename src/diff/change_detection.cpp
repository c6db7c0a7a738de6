#include "diff/change_detection.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "volume/voxel_checksum.h"

namespace kairos {
namespace {

// The same leaf in both fields; -1 where a field does not store it.
struct LeafPair {
  Vec3i origin;
  int64_t before, after;
};

std::vector<LeafPair> pairLeaves(const Field& before, const Field& after) {
  std::vector<LeafPair> pairs;
  pairs.reserve(std::max(before.leafCount(), after.leafCount()));
  size_t b = 0, a = 0;
  while (b < before.leafCount() || a < after.leafCount()) {
    const bool onlyBefore = a == after.leafCount() ||
                            (b < before.leafCount() && lessZYX(before.leafOrigins[b], after.leafOrigins[a]));
    const bool onlyAfter = b == before.leafCount() ||
                           (a < after.leafCount() && lessZYX(after.leafOrigins[a], before.leafOrigins[b]));
    if (onlyBefore) {
      pairs.push_back({before.leafOrigins[b], int64_t(b), -1});
      ++b;
    } else if (onlyAfter) {
      pairs.push_back({after.leafOrigins[a], -1, int64_t(a)});
      ++a;
    } else {
      pairs.push_back({before.leafOrigins[b], int64_t(b), int64_t(a)});
      ++b;
      ++a;
    }
  }
  return pairs;
}

template <class T>
bool hasChanged(T before, T after, double tolerance) {
  if (bitsOf(before) == bitsOf(after)) return false;
  if (tolerance == 0 || !isFiniteValue(before) || !isFiniteValue(after)) return true;
  return std::abs(double(after) - double(before)) > tolerance;
}

// Compares one leaf; returns the change of the state checksum, or 0.
template <bool kChecksummed, class T>
uint64_t compareLeaf(const T* before, const T* after, double tolerance, T background, ChangedLeaf& leaf) {
  if (std::memcmp(before, after, kLeafVoxels * sizeof(T)) == 0) return 0;
  uint64_t checksum = 0;
  for (int i = 0; i < kLeafVoxels; ++i) {
    if (!hasChanged(before[i], after[i], tolerance)) continue;
    leaf.mask[size_t(i >> 6)] |= uint64_t(1) << (i & 63);
    if constexpr (!kChecksummed) continue;
    const Vec3i v = leaf.origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
    const uint64_t place = checksumOfPlace(v);
    checksum += checksumTerm(place, bitsOf(after[i]), bitsOf(background)) -
                checksumTerm(place, bitsOf(before[i]), bitsOf(background));
  }
  return checksum;
}

// Zeros of different sign are different values here as in any voxel.
bool sameBackground(double a, double b) {
  return (a == b && std::signbit(a) == std::signbit(b)) || (std::isnan(a) && std::isnan(b));
}

template <class T>
class Comparison {
 public:
  Comparison(const Field& before, const Field& after, double tolerance, bool checksummed)
      : before_(valuesAs<T>(before.values)),
        after_(valuesAs<T>(after.values)),
        tolerance_(tolerance),
        checksummed_(checksummed),
        background_(T(before.background)) {
    empty_.assign(kLeafVoxels, background_);
  }

  // Returns the change of the state checksum, or 0.
  uint64_t run(const std::vector<LeafPair>& pairs, ThreadPool& pool, ChangedVoxels& changes) {
    std::vector<ChangedLeaf> leaves(pairs.size());
    std::vector<uint64_t> checksums(pairs.size());
    constexpr size_t kGrain = 64;
    pool.forEach(pairs.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        leaves[i].origin = pairs[i].origin;
        const T *before = valuesOf(before_, pairs[i].before), *after = valuesOf(after_, pairs[i].after);
        checksums[i] = checksummed_ ? compareLeaf<true>(before, after, tolerance_, background_, leaves[i])
                                    : compareLeaf<false>(before, after, tolerance_, background_, leaves[i]);
      }
    });
    uint64_t checksum = 0, total = 0;
    std::vector<const T*> sources;
    for (size_t i = 0; i < pairs.size(); ++i) {
      const int count = leaves[i].count();
      if (count == 0) continue;
      checksum += checksums[i];
      leaves[i].first = total;
      total += uint64_t(count);
      changes.leaves.push_back(leaves[i]);
      sources.push_back(valuesOf(after_, pairs[i].after));
    }
    std::vector<T> values(total);
    pool.forEach(sources.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) pack(changes.leaves[i], sources[i], values.data());
    });
    changes.values = std::move(values);
    return checksum;
  }

 private:
  const T* valuesOf(const std::vector<T>& values, int64_t leaf) const {
    return leaf < 0 ? empty_.data() : values.data() + leaf * kLeafVoxels;
  }
  static void pack(const ChangedLeaf& leaf, const T* source, T* values) {
    T* out = values + leaf.first;
    for (int z = 0; z < 8; ++z)
      for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1)
        *out++ = source[z * 64 + std::countr_zero(word)];
  }

  const std::vector<T>&before_, &after_;
  double tolerance_;
  bool checksummed_;
  T background_;
  std::vector<T> empty_;
};

}  // namespace

ChangeDetector::ChangeDetector(Field first, double tolerance, States states)
    : reconstruction_(std::move(first)), tolerance_(tolerance), states_(states) {
  if (states == States::checksummed) state_ = stateChecksum(reconstruction_);
  if (!(tolerance >= 0) || !std::isfinite(tolerance))
    throw OptionError("--tolerance",
                      "found " + std::to_string(tolerance) + ", expected a finite number >= 0");
}

ChangedVoxels ChangeDetector::advance(Field next, ThreadPool& pool) {
  if (next.type() != reconstruction_.type())
    throw StateError("this step holds " + std::string(name(next.type())) + " values, the one before " +
                     std::string(name(reconstruction_.type())));
  if (!sameBackground(next.background, reconstruction_.background))
    throw StateError("this step has background " + std::to_string(next.background) + ", the one before " +
                     std::to_string(reconstruction_.background));
  const std::vector<LeafPair> pairs = pairLeaves(reconstruction_, next);
  ChangedVoxels changes;
  const bool checksummed = states_ == States::checksummed;
  if (checksummed) changes.stateBefore = state_;
  dispatch(next.type(), [&]<class T>() {
    state_ += Comparison<T>(reconstruction_, next, tolerance_, checksummed).run(pairs, pool, changes);
  });
  if (checksummed) changes.stateAfter = state_;
  if (tolerance_ == 0)
    reconstruction_ = std::move(next);
  else
    applyChanges(changes, reconstruction_);
  return changes;
}

}  // namespace kairos
