// Every voxel of every brick, ranges and dirty masks against brute force.
#include "volume/brick_volume.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "support/changes.h"
#include "support/scenes.h"

namespace kairos {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A dense copy of a field, because Field::value is slow.
class Model {
 public:
  Model(const Lattice& lattice, const Field& field)
      : lattice_(lattice),
        box_{lattice.domain.lo - Vec3i{40, 40, 40}, lattice.domain.hi + Vec3i{40, 40, 40}},
        background_(std::isfinite(lattice.background) ? lattice.background : 0) {
    values_.assign(size_t(box_.voxelCount()), background_);
    for (const Vec3i& origin : field.leafOrigins)
      for (int i = 0; i < kLeafVoxels; ++i) {
        const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
        set(v, field.value(v));
      }
  }
  void set(const Vec3i& v, double value) { values_[at(v)] = std::isfinite(value) ? value : background_; }
  double operator()(const Vec3i& v) const { return values_[at(lattice_.sourceOf(v))]; }

 private:
  size_t at(const Vec3i& v) const {
    const Vec3i p = v - box_.lo, s = box_.size();
    return size_t((int64_t(p.z) * s.y + p.y) * s.x + p.x);
  }
  Lattice lattice_;
  VoxelBox box_;
  double background_;
  std::vector<double> values_;
};

template <class F>
void forEachBrickVoxel(const BrickVolume& volume, uint32_t cell, F&& f) {
  dispatch(volume.lattice().type, [&]<class T>() {
    const T* brick = volume.brick<T>(cell);
    for (int z = 0; z < kBrickStride; ++z)
      for (int y = 0; y < kBrickStride; ++y)
        for (int x = 0; x < kBrickStride; ++x)
          f(volume.cellOrigin(cell) + Vec3i{x, y, z}, Vec3i{x, y, z},
            double(brick[(z * kBrickStride + y) * kBrickStride + x]));
  });
}

// The range of the 8^3 voxels from each 4^3 block's first.
void expectWindows(const BrickVolume& volume, uint32_t cell, const Model& model) {
  double lo[kWindows], hi[kWindows];
  std::fill_n(lo, kWindows, HUGE_VAL);
  std::fill_n(hi, kWindows, -HUGE_VAL);
  forEachBrickVoxel(volume, cell, [&](const Vec3i& v, const Vec3i& local, double) {
    const double value = model(v);
    const Vec3i block{local.x / kWindowBlock, local.y / kWindowBlock, local.z / kWindowBlock};
    for (int n = 0; n < 8; ++n) {
      const Vec3i w = block - Vec3i{n & 1, n >> 1 & 1, n >> 2};
      if (!VoxelBox{{0, 0, 0}, {4, 4, 4}}.contains(w)) continue;
      const auto window = size_t(w.x + 4 * w.y + 16 * w.z);
      lo[window] = std::min(lo[window], value);
      hi[window] = std::max(hi[window], value);
    }
  });
  const auto ranges = volume.windowRanges(cell);
  for (size_t w = 0; w < kWindows; ++w)
    ASSERT_EQ(ranges[w], (ValueRange{float(lo[w]), float(hi[w])})) << "window " << w << " of cell " << cell;
}

// Values with aprons, exact ranges, and one shared brick for cells of background.
void expectEquals(const BrickVolume& volume, const Model& model) {
  uint32_t stored = 0;
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    int wrong = 0;
    forEachBrickVoxel(volume, cell, [&](const Vec3i& v, const Vec3i&, double value) {
      wrong += value != model(v);
      lo = std::min(lo, model(v));
      hi = std::max(hi, model(v));
    });
    ASSERT_EQ(wrong, 0) << "cell " << cell;
    ASSERT_EQ(volume.range(cell), (ValueRange{float(lo), float(hi)})) << "cell " << cell;
    expectWindows(volume, cell, model);
    ASSERT_EQ(volume.isBackground(cell), lo == hi && lo == volume.background()) << "cell " << cell;
    stored += !volume.isBackground(cell);
  }
  ASSERT_EQ(volume.allocatedBricks(), stored + 1);  // and the shared one
}

TEST(BrickVolume, HoldsEveryVoxelOfTheFieldInEveryBrickAndApron) {
  ThreadPool pool(2);
  for (ElementType type : test::kAllTypes)
    for (const auto& scene : test::allScenes(type)) {
      const BrickVolume volume(scene.lattice, scene.field, pool);
      expectEquals(volume, Model(scene.lattice, scene.field));
      if (HasFatalFailure()) FAIL() << scene.name << " " << name(type);
    }
}

TEST(BrickVolume, CoversTheDomainWithRoomForEveryFootprint) {
  ThreadPool pool(1);
  // Every residue of the domain's ends against the brick grid.
  for (int lo = -19; lo <= 3; ++lo)
    for (int extent : {1, 2, 15, 16, 17, 33}) {
      const Lattice lattice = test::sparseLattice(ElementType::u8, {extent, 1, 1}, {lo, -lo, 0});
      Field empty;
      empty.values = makeVoxelArray(ElementType::u8);
      const BrickVolume volume(lattice, empty, pool);
      for (int a = 0; a < 3; ++a) {
        EXPECT_LE(volume.gridOrigin()[a], lattice.domain.lo[a] - 5);
        EXPECT_GT(volume.gridOrigin()[a] + kBrickEdge * volume.gridSize()[a], lattice.domain.hi[a]);
      }
    }
}

TEST(BrickVolume, NumbersItsCellsXFastest) {
  ThreadPool pool(1);
  const auto scene = test::denseNoise(ElementType::u8);
  const BrickVolume volume(scene.lattice, scene.field, pool);
  for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
    EXPECT_EQ(volume.cellIndex(volume.cellCoordinates(cell)), cell);
    EXPECT_EQ(volume.cellOrigin(cell), volume.gridOrigin() + volume.cellCoordinates(cell) * kBrickEdge);
  }
  EXPECT_EQ(volume.cellCoordinates(1), (Vec3i{1, 0, 0}));
}

// ---- updates ----

// Which sub-blocks of which cells hold a voxel of `written`.
std::map<uint32_t, uint64_t> bruteForceDirt(const BrickVolume& volume, const test::VoxelMap& written) {
  std::map<uint32_t, uint64_t> dirt;
  const auto mark = [&](const Vec3i& v) {
    for (uint32_t cell = 0; cell < volume.cellCount(); ++cell) {
      const Vec3i local = v - volume.cellOrigin(cell);
      if (!VoxelBox{{0, 0, 0}, {kBrickStride, kBrickStride, kBrickStride}}.contains(local)) continue;
      const Vec3i block{local.x / kSubBlockEdge, local.y / kSubBlockEdge, local.z / kSubBlockEdge};
      dirt[cell] |= uint64_t(1) << (block.x + 4 * block.y + 16 * block.z);
    }
  };
  for (const auto& [v, value] : written) {
    mark(v);
    // Outside a face, the voxels that repeat this one.
    for (int n = 0; n < 27; ++n)
      if (const Vec3i w = v + Vec3i{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
          w != v && volume.lattice().sourceOf(w) == v)
        mark(w);
  }
  return dirt;
}

// The marks must be exact for the sub-blocks; at the faces of dense data, where the layer outside repeats the
// voxels inside, they may be more. Cells may be listed with no mark at all: a leaf that reaches into an apron
// whose changed voxels do not.
void expectDirt(const DirtyBricks& dirty, std::map<uint32_t, uint64_t> expected, bool dense) {
  ASSERT_EQ(dirty.cells.size(), dirty.subBlocks.size());
  for (size_t i = 0; i < dirty.cells.size(); ++i) {
    if (i > 0) {
      ASSERT_LT(dirty.cells[i - 1], dirty.cells[i]);
    }
    const auto it = expected.find(dirty.cells[i]);
    const uint64_t marks = it == expected.end() ? 0 : it->second;
    ASSERT_EQ(dirty.subBlocks[i] & (dense ? marks : ~uint64_t(0)), marks) << "cell " << dirty.cells[i];
    if (it != expected.end()) expected.erase(it);
  }
  ASSERT_TRUE(expected.empty()) << "cell " << expected.begin()->first << " was not marked";
}

VoxelBox randomBox(const VoxelBox& domain, std::mt19937& random) {
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    std::uniform_int_distribution<int> place(domain.lo[a], domain.hi[a] - 1);
    const int p = place(random), q = place(random);
    box.lo[a] = std::min(p, q);
    box.hi[a] = std::max(p, q) + 1;
  }
  return box;
}

TEST(BrickVolumeUpdate, FollowsTheFieldThroughRandomSequences) {
  std::mt19937 random(21);
  for (ElementType type : test::kAllTypes)
    for (const bool dense : {false, true})
      for (int threads : {1, 4}) {
        ThreadPool pool(threads);
        auto scene = dense ? test::denseNoise(type) : test::plume(type);
        BrickVolume volume(scene.lattice, scene.field, pool);
        Model model(scene.lattice, scene.field);
        for (int step = 0; step < 6; ++step) {
          const auto written = test::randomVoxels(type, randomBox(scene.lattice.domain, random),
                                                  step == 0 ? 1 : 400, 0, random);
          for (const auto& [v, value] : written) model.set(v, value);
          expectDirt(volume.apply(test::changesOf(type, written), pool), bruteForceDirt(volume, written),
                     volume.lattice().dense);
          expectEquals(volume, model);
          if (HasFatalFailure()) FAIL() << scene.name << " " << name(type) << " step " << step;
        }
      }
}

TEST(BrickVolumeUpdate, WritesWholeLeavesAndRowsAtEveryPlaceInABrick) {
  ThreadPool pool(1);
  for (ElementType type : test::kAllTypes) {
    const Lattice lattice = test::sparseLattice(type, {64, 64, 64}, {-32, -32, -32});
    Field empty;
    empty.values = makeVoxelArray(type);
    BrickVolume volume(lattice, empty, pool);
    Model model(lattice, empty);
    std::mt19937 random(2);
    for (const Vec3i& origin : {Vec3i{-32, -32, -32}, {-8, 0, 8}, {0, 0, 0}, {24, 24, 24}, {8, -16, 0}}) {
      test::VoxelMap written;
      for (int i = 0; i < kLeafVoxels; ++i)
        if ((i >> 3) % 3 != 1) written[origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6}] = 1 + i % 200;
      for (const auto& [v, value] : written) model.set(v, value);
      expectDirt(volume.apply(test::changesOf(type, written), pool), bruteForceDirt(volume, written),
                 volume.lattice().dense);
      expectEquals(volume, model);
    }
  }
}

TEST(BrickVolumeUpdate, GivesBricksBackWhenTheyEmpty) {
  // Cells that stay empty hold a brick while they are updated: with more threads, more at a time.
  ThreadPool pool(1);
  for (ElementType type : test::kAllTypes) {
    const auto scene = test::sparseBalls(type);
    Field empty;
    empty.values = makeVoxelArray(type);
    BrickVolume volume(scene.lattice, empty, pool);
    EXPECT_EQ(volume.allocatedBricks(), 1u);
    test::VoxelMap matter, nothing;
    for (const Vec3i& origin : scene.field.leafOrigins)
      for (int i = 0; i < kLeafVoxels; ++i) {
        const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
        matter[v] = scene.field.value(v);
        nothing[v] = 0;
      }
    const BrickVolume whole(scene.lattice, scene.field, pool);
    uint64_t memory = 0;
    for (int round = 0; round < 3; ++round) {
      volume.apply(test::changesOf(type, matter), pool);
      EXPECT_EQ(volume.allocatedBricks(), whole.allocatedBricks());
      EXPECT_GT(volume.allocatedBricks(), 8u);
      volume.apply(test::changesOf(type, nothing), pool);
      EXPECT_EQ(volume.allocatedBricks(), 1u);
      if (round == 0) memory = volume.memoryBytes();
      EXPECT_EQ(volume.memoryBytes(), memory);  // rounds reuse what the first one allocated
    }
  }
}

TEST(BrickVolumeUpdate, ThreadsChangeNoBit) {
  const auto run = [](int threads) {
    ThreadPool pool(threads);
    std::mt19937 random(8);
    const auto scene = test::plume(ElementType::f32);
    auto volume = std::make_unique<BrickVolume>(scene.lattice, scene.field, pool);
    std::vector<DirtyBricks> dirt;
    for (int step = 0; step < 5; ++step) {
      const auto written = test::randomVoxels(ElementType::f32, scene.lattice.domain, 3000, 0, random);
      dirt.push_back(volume->apply(test::changesOf(ElementType::f32, written), pool));
    }
    return std::pair(std::move(volume), dirt);
  };
  const auto [one, dirtOne] = run(1);
  const auto [four, dirtFour] = run(4);
  ASSERT_EQ(one->cellCount(), four->cellCount());
  for (uint32_t cell = 0; cell < one->cellCount(); ++cell) {
    EXPECT_EQ(std::memcmp(one->brick<float>(cell), four->brick<float>(cell), kBrickVoxels * sizeof(float)), 0)
        << cell;
    EXPECT_EQ(one->range(cell), four->range(cell));
  }
  for (size_t step = 0; step < dirtOne.size(); ++step) {
    EXPECT_EQ(dirtOne[step].cells, dirtFour[step].cells);
    EXPECT_EQ(dirtOne[step].subBlocks, dirtFour[step].subBlocks);
  }
}

// Every instruction set that the update is compiled for, the plain one included.
TEST(BrickVolumeUpdate, InstructionSetsChangeNoBit) {
  ThreadPool pool(1);
  const std::vector<int64_t> targets = {HWY_AVX3, HWY_AVX2, HWY_STATIC_TARGET};
  for (ElementType type : test::kAllTypes) {
    const auto scene = test::plume(type);
    std::mt19937 random(3);
    const auto written = test::randomVoxels(type, scene.lattice.domain, 20000, 0, random);
    Model model(scene.lattice, scene.field);
    for (const auto& [v, value] : written) model.set(v, value);
    for (const int64_t target : targets) {
      if ((hwy::SupportedTargets() & target) == 0) continue;
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().DeInit();
      BrickVolume volume(scene.lattice, scene.field, pool);
      expectDirt(volume.apply(test::changesOf(type, written), pool), bruteForceDirt(volume, written), false);
      expectEquals(volume, model);
      hwy::SetSupportedTargetsForTest(0);
      hwy::GetChosenTarget().DeInit();
      if (HasFatalFailure()) FAIL() << name(type) << " " << hwy::TargetName(target);
    }
  }
}

// ---- values that are not numbers ----

TEST(BrickVolume, StoresNaNAndInfinityAsTheBackground) {
  ThreadPool pool(1);
  std::vector<float> dense(20 * 20 * 20, 4.0f);
  dense[0] = kNaN;
  dense[1] = kInfinity;
  dense[7999] = -kInfinity;
  Lattice lattice = test::denseLattice(ElementType::f32, {20, 20, 20});
  lattice.background = 1.5;
  const Field field = fieldFromDense(dense.data(), {20, 20, 20}, 1.5f);
  BrickVolume volume(lattice, field, pool);
  Model model(lattice, field);
  EXPECT_EQ(model({0, 0, 0}), 1.5);
  expectEquals(volume, model);
  for (const float odd : {kNaN, kInfinity, -kInfinity}) {
    volume.apply(test::changesOf(ElementType::f32, {{{5, 5, 5}, odd}, {{6, 5, 5}, 9.0}}), pool);
    model.set({5, 5, 5}, odd);
    model.set({6, 5, 5}, 9);
    expectEquals(volume, model);
  }
}

TEST(BrickVolume, ANonFiniteBackgroundIsAbsentAndReadsAsZero) {
  ThreadPool pool(1);
  for (const float odd : {kNaN, kInfinity}) {
    Lattice lattice = test::sparseLattice(ElementType::f32, {9, 9, 9});
    lattice.background = odd;
    std::vector<float> dense(729, odd);
    dense[364] = 3;
    const Field field = fieldFromDense(dense.data(), {9, 9, 9}, odd);
    const BrickVolume volume(lattice, field, pool);
    EXPECT_EQ(volume.background(), 0.0);
    expectEquals(volume, Model(lattice, field));
  }
}

}  // namespace
}  // namespace kairos
