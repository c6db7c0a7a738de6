#include "diff/change_detection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <set>

#include "core/error.h"
#include "sequences.h"

namespace kairos::test {
namespace {

using testing::HasSubstr;

/// Raw bits of every voxel of a box: what "the same field" means.
template <class T>
std::vector<T> denseCopy(const Field& field, const VoxelBox& box) {
  std::vector<T> dense(size_t(box.voxelCount()), T(field.background));
  const Vec3i size = box.size();
  for (size_t leaf = 0; leaf < field.leafCount(); ++leaf)
    for (int i = 0; i < kLeafVoxels; ++i) {
      const Vec3i v = field.leafOrigins[leaf] + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
      if (!box.contains(v)) continue;
      const Vec3i at = v - box.lo;
      dense[size_t((at.z * size.y + at.y) * size.x + at.x)] =
          valuesAs<T>(field.values)[leaf * kLeafVoxels + size_t(i)];
    }
  return dense;
}

template <class T>
bool sameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

template <class T>
T randomValue(std::mt19937& random) {
  if constexpr (std::is_same_v<T, float>) {
    const uint32_t odd[] = {0x7fc00000, 0x7fc00001, 0xffc12345, 0x7f800001, 0x7f800000, 0xff800000,
                            0x80000000, 0x00000000, 0x00000001, 0x807fffff, 0x7f7fffff, 0x00800000};
    if (random() % 3 == 0) return std::bit_cast<float>(odd[random() % std::size(odd)]);
    return std::uniform_real_distribution<float>(-2, 2)(random);
  } else {
    return random() % 4 ? T(random()) : T(0);
  }
}

/// Arrays in which a random part of the voxels changes from step to step; sometimes all return to zero.
template <class T>
std::vector<std::vector<T>> randomArrays(const Vec3i& dims, int steps, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::vector<T>> arrays(1,
                                     std::vector<T>(size_t(dims.x) * size_t(dims.y) * size_t(dims.z), T(0)));
  for (int step = 1; step < steps; ++step) {
    arrays.push_back(arrays.back());
    if (step % 7 == 6) arrays.back().assign(arrays.back().size(), T(0));
    const size_t changes = step % 3 == 0 ? arrays.back().size() : size_t(step * step);
    for (size_t i = 0; i < changes; ++i)
      arrays.back()[random() % arrays.back().size()] = randomValue<T>(random);
  }
  return arrays;
}

constexpr Vec3i kDims{21, 18, 13}, kOrigin{-10, 3, -5};
constexpr VoxelBox kBox{kOrigin, {11, 21, 8}};

template <class T>
class ExactChain : public testing::Test {};
using ElementTypes = testing::Types<uint8_t, uint16_t, float>;
TYPED_TEST_SUITE(ExactChain, ElementTypes);

TYPED_TEST(ExactChain, RebuildsEveryStepBitForBit) {
  using T = TypeParam;
  const auto arrays = randomArrays<T>(kDims, 25, 3);
  ThreadPool pool(2);
  Field reader = fieldFromDense(arrays[0].data(), kDims, T(0), kOrigin);
  ChangeDetector detector(reader, 0);
  for (size_t step = 1; step < arrays.size(); ++step) {
    applyChanges(detector.advance(fieldFromDense(arrays[step].data(), kDims, T(0), kOrigin), pool), reader);
    EXPECT_TRUE(sameBits(denseCopy<T>(reader, kBox), arrays[step])) << step;
    EXPECT_TRUE(sameBits(denseCopy<T>(detector.reconstruction(), kBox), arrays[step])) << step;
  }
}

TYPED_TEST(ExactChain, ListsExactlyTheVoxelsWhoseBitsDiffer) {
  using T = TypeParam;
  const auto arrays = randomArrays<T>(kDims, 12, 4);
  ThreadPool pool(1);
  ChangeDetector detector(fieldFromDense(arrays[0].data(), kDims, T(0), kOrigin), 0);
  for (size_t step = 1; step < arrays.size(); ++step) {
    const ChangedVoxels changes =
        detector.advance(fieldFromDense(arrays[step].data(), kDims, T(0), kOrigin), pool);
    std::set<Vec3i, LessZYX> expected, found;
    for (size_t i = 0; i < arrays[step].size(); ++i)
      if (std::memcmp(&arrays[step - 1][i], &arrays[step][i], sizeof(T)) != 0)
        expected.insert(kOrigin +
                        Vec3i{int(i) % kDims.x, int(i) / kDims.x % kDims.y, int(i) / kDims.x / kDims.y});
    for (uint64_t i = 0; i < changes.count(); ++i) found.insert(changes.locate(i));
    EXPECT_EQ(found.size(), changes.count());
    EXPECT_EQ(found, expected) << step;
    for (size_t leaf = 1; leaf < changes.leaves.size(); ++leaf) {
      EXPECT_TRUE(lessZYX(changes.leaves[leaf - 1].origin, changes.leaves[leaf].origin));
      EXPECT_EQ(changes.leaves[leaf].first,
                changes.leaves[leaf - 1].first + uint64_t(changes.leaves[leaf - 1].count()));
    }
  }
}

TYPED_TEST(ExactChain, ChecksumsChainFromStateToState) {
  using T = TypeParam;
  const auto arrays = randomArrays<T>(kDims, 15, 5);
  ThreadPool pool(2);
  ChangeDetector detector(fieldFromDense(arrays[0].data(), kDims, T(0), kOrigin), 0);
  uint64_t state = detector.state();
  EXPECT_EQ(state, stateChecksum(detector.reconstruction()));
  for (size_t step = 1; step < arrays.size(); ++step) {
    const ChangedVoxels changes =
        detector.advance(fieldFromDense(arrays[step].data(), kDims, T(0), kOrigin), pool);
    EXPECT_EQ(changes.stateBefore, state);
    state = stateChecksum(fieldFromDense(arrays[step].data(), kDims, T(0), kOrigin));
    EXPECT_EQ(changes.stateAfter, state) << step;
    EXPECT_EQ(detector.state(), state);
  }
}

TYPED_TEST(ExactChain, ThreadsChangeNothing) {
  using T = TypeParam;
  const Vec3i dims{70, 60, 50};
  const auto arrays = randomArrays<T>(dims, 5, 6);
  ThreadPool one(1), four(4);
  for (const double tolerance : {0.0, 3.0}) {
    ChangeDetector a(fieldFromDense(arrays[0].data(), dims), tolerance),
        b(fieldFromDense(arrays[0].data(), dims), tolerance);
    for (size_t step = 1; step < arrays.size(); ++step) {
      const ChangedVoxels x = a.advance(fieldFromDense(arrays[step].data(), dims), one);
      const ChangedVoxels y = b.advance(fieldFromDense(arrays[step].data(), dims), four);
      EXPECT_EQ(contentChecksum(x), contentChecksum(y));
      EXPECT_EQ(x.count(), y.count());
      EXPECT_EQ(x.stateAfter, y.stateAfter);
    }
  }
}

TEST(ExactChain, KeepsOddFloatsApart) {
  const uint32_t before[] = {0x7fc00000, 0x7fc00000, 0x00000000, 0x80000000,
                             0x7f800000, 0x00000001, 0x3f800000, 0x7f800001};
  const uint32_t after[] = {0x7fc00000, 0x7fc00001, 0x80000000, 0x80000000,
                            0xff800000, 0x00000002, 0x7fc00000, 0x3f800000};
  std::vector<float> a, b;
  for (size_t i = 0; i < 8; ++i) {
    a.push_back(std::bit_cast<float>(before[i]));
    b.push_back(std::bit_cast<float>(after[i]));
  }
  ThreadPool pool(1);
  ChangeDetector detector(fieldFromDense(a.data(), {8, 1, 1}), 0);
  const ChangedVoxels changes = detector.advance(fieldFromDense(b.data(), {8, 1, 1}), pool);
  ASSERT_EQ(changes.leaves.size(), 1u);
  EXPECT_EQ(changes.leaves[0].mask[0], 0b11110110u);
  EXPECT_TRUE(sameBits(denseCopy<float>(detector.reconstruction(), {{0, 0, 0}, {8, 1, 1}}), b));
}

TEST(ExactChain, LeavesAppearAndVanish) {
  const Lattice lattice = sparseLattice(ElementType::u8, {40, 40, 40});
  ThreadPool pool(1);
  ChangeDetector detector(fieldOf(lattice, {{{3, 3, 3}, 9}, {{30, 3, 3}, 8}}), 0);
  const ChangedVoxels away = detector.advance(fieldOf(lattice, {{{3, 30, 30}, 7}}), pool);
  EXPECT_EQ(away.count(), 3u);
  EXPECT_EQ(detector.reconstruction().value({3, 3, 3}), 0);
  EXPECT_EQ(detector.reconstruction().value({3, 30, 30}), 7);
  const ChangedVoxels empty = detector.advance(fieldOf(lattice, {}), pool);
  EXPECT_EQ(empty.count(), 1u);
  EXPECT_EQ(detector.state(), stateChecksum(fieldOf(lattice, {})));
  EXPECT_TRUE(detector.advance(fieldOf(lattice, {}), pool).empty());
}

TEST(ExactChain, AStoredLeafOfBackgroundIsNoChange) {
  const Lattice lattice = sparseLattice(ElementType::f32, {16, 16, 16});
  Field stored = fieldOf(lattice, {{{3, 3, 3}, 1}});
  applyChanges(changesOf(ElementType::f32, {{{3, 3, 3}, 0}}), stored);
  ThreadPool pool(1);
  ChangeDetector detector(stored, 0);
  EXPECT_TRUE(detector.advance(fieldOf(lattice, {}), pool).empty());
  EXPECT_TRUE(detector.advance(stored, pool).empty());
}

// ---- with a tolerance ----

template <class T>
double largestError(const Field& reconstruction, const std::vector<T>& exact) {
  const std::vector<T> dense = denseCopy<T>(reconstruction, kBox);
  double worst = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    if (!isFiniteValue(exact[i]) || !isFiniteValue(dense[i])) {
      if (std::memcmp(&exact[i], &dense[i], sizeof(T)) != 0) return std::numeric_limits<double>::infinity();
      continue;
    }
    worst = std::max(worst, std::abs(double(exact[i]) - double(dense[i])));
  }
  return worst;
}

template <class T>
void expectBoundedError(const std::function<T(size_t voxel, int step)>& value, double tolerance) {
  std::vector<T> array(size_t(kBox.voxelCount()));
  const auto fill = [&](int step) {
    for (size_t i = 0; i < array.size(); ++i) array[i] = value(i, step);
    return fieldFromDense(array.data(), kDims, T(0), kOrigin);
  };
  ThreadPool pool(2);
  Field reader = fill(0);
  ChangeDetector detector(reader, tolerance);
  uint64_t changed = 0;
  for (int step = 1; step <= 100; ++step) {
    const ChangedVoxels changes = detector.advance(fill(step), pool);
    applyChanges(changes, reader);
    changed += changes.count();
    EXPECT_LE(largestError(reader, array), tolerance) << step;
    EXPECT_EQ(stateChecksum(reader), changes.stateAfter) << step;
    EXPECT_EQ(stateChecksum(detector.reconstruction()), changes.stateAfter) << step;
  }
  EXPECT_GT(changed, 0u);
  EXPECT_LT(changed, 100 * array.size());
}

TEST(Tolerance, BoundsTheErrorOfASlowDriftAtEveryStep) {
  // Every step moves a voxel by less than the tolerance; a comparison with the step before would never
  // notice.
  expectBoundedError<float>([](size_t i, int step) { return float(0.1 + 0.0021 * step * double(1 + i % 5)); },
                            0.0125);
  expectBoundedError<uint16_t>([](size_t i, int step) { return uint16_t(1000 + 7 * step * int(1 + i % 3)); },
                               25);
  expectBoundedError<uint8_t>([](size_t i, int step) { return uint8_t(20 + step + int(i % 9)); }, 2);
}

TEST(Tolerance, BoundsTheErrorOfNoiseAndWavesAtEveryStep) {
  expectBoundedError<float>([](size_t i, int step) { return float(std::sin(0.1 * double(i) + 0.3 * step)); },
                            0.05);
  expectBoundedError<float>(
      [](size_t i, int step) {
        return float(whiteNoise({int(i), step, 0}, 1) * std::pow(10.0, double(i % 30) - 15));
      },
      1e-3);
  expectBoundedError<uint8_t>(
      [](size_t i, int step) {
        return uint8_t(255 * whiteNoise({int(i), step, 0}, 2));
      },
      40);
}

TEST(Tolerance, KeepsNonFiniteValuesExactly) {
  expectBoundedError<float>(
      [](size_t i, int step) {
        if (i % 4 == 0 && step % 5 == 1) return std::numeric_limits<float>::quiet_NaN();
        if (i % 4 == 1 && step % 3 == 1)
          return i % 8 ? std::numeric_limits<float>::infinity() : -std::numeric_limits<float>::infinity();
        return float(0.01 * step);
      },
      0.05);
}

TEST(Tolerance, OfExactlyTheChangeIsNotAChange) {
  const std::vector<uint8_t> a(8, 10), b{10, 12, 13, 8, 7, 255, 10, 11};
  ThreadPool pool(1);
  ChangeDetector detector(fieldFromDense(a.data(), {8, 1, 1}), 2);
  const ChangedVoxels changes = detector.advance(fieldFromDense(b.data(), {8, 1, 1}), pool);
  EXPECT_EQ(changes.leaves.at(0).mask[0], 0b00110100u);
}

TEST(Tolerance, OutOfRangeIsRefused) {
  const Field field = constantScene(ElementType::u8, {8, 8, 8}, 0.5).field;
  for (const double bad :
       {-1.0, -1e-300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(ChangeDetector(field, bad), OptionError) << bad;
}

// ---- steps that do not belong together ----

std::string messageOf(ChangeDetector& detector, const Field& next) {
  ThreadPool pool(1);
  try {
    detector.advance(next, pool);
  } catch (const StateError& e) {
    return e.what();
  }
  return "nothing was thrown";
}

TEST(ChangeDetector, RefusesAnotherTypeOrBackgroundAndStaysAsItWas) {
  const Lattice lattice = sparseLattice(ElementType::f32, {16, 16, 16});
  const Field first = fieldOf(lattice, {{{1, 2, 3}, 0.5}});
  ChangeDetector detector(first, 0);
  EXPECT_THAT(messageOf(detector, constantScene(ElementType::u16, {8, 8, 8}, 0.5).field),
              testing::AllOf(HasSubstr("u16"), HasSubstr("f32")));
  Field other = first;
  other.background = 0.25;
  EXPECT_THAT(messageOf(detector, other), HasSubstr("0.25"));
  other.background = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(messageOf(detector, other), HasSubstr("nan"));
  other.background = -0.0;  // as a value of its own, since voxels outside the leaves would change unnoticed
  EXPECT_THAT(messageOf(detector, other), HasSubstr("-0.0"));
  EXPECT_EQ(detector.state(), stateChecksum(first));
  ThreadPool pool(1);
  EXPECT_TRUE(detector.advance(first, pool).empty());
}

TEST(ChangeDetector, ANaNBackgroundEqualsItself) {
  Field field = fieldOf(sparseLattice(ElementType::f32, {8, 8, 8}), {{{1, 2, 3}, 0.5}});
  field.background = std::numeric_limits<double>::quiet_NaN();
  ChangeDetector detector(field, 0);
  ThreadPool pool(1);
  EXPECT_TRUE(detector.advance(field, pool).empty());
}

TEST(ChangeDetector, WithoutChecksumsOfTheStatesFindsTheSameChanges) {
  const Sequence sequence = ballSequence(ElementType::f32);
  ThreadPool pool(1);
  ChangeDetector named(sequence.steps[0], 0);
  ChangeDetector unnamed(sequence.steps[0], 0, ChangeDetector::States::unnamed);
  for (size_t step = 1; step < sequence.steps.size(); ++step) {
    const ChangedVoxels a = named.advance(sequence.steps[step], pool),
                        b = unnamed.advance(sequence.steps[step], pool);
    EXPECT_EQ(contentChecksum(a), contentChecksum(b));
    EXPECT_TRUE(a.stateBefore && a.stateAfter);
    EXPECT_FALSE(b.stateBefore || b.stateAfter);
  }
}

}  // namespace
}  // namespace kairos::test
