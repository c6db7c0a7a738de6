// A simulation that runs for long: no error and no memory may pile up.
#include <gtest/gtest.h>
#include <malloc.h>

#include <random>

#include "diff/differential_renderer.h"
#include "numerics/field_oracle.h"
#include "support/changes.h"
#include "support/images.h"

namespace kairos {
namespace {

constexpr int kSteps = 10'000;
constexpr int kEdge = 34;

RenderSettings settingsFor(const Lattice& lattice) {
  RenderSettings settings =
      test::settingsFor({"chain", lattice, {}}, "iso", test::softTransferFunction(lattice.type), 28, 24);
  settings.depth = true;
  return settings;
}

size_t heapInUse() {
  return mallinfo2().uordblks;
}

// Steps a few voxels at a time, here and there, through `kSteps` steps; the model holds every voxel ever
// written.
class Chain {
 public:
  explicit Chain(ElementType type)
      : lattice_(test::denseLattice(type, {kEdge, kEdge, kEdge})),
        renderer_(lattice_, settingsFor(lattice_), {.method = Method::segments, .threads = 1}) {
    field_ = test::sampledField(lattice_, [](const Vec3i& v) { return 0.3 * test::whiteNoise(v, 1); });
    renderer_.start(field_);
  }

  void step() {
    const auto place = [&] { return int32_t(random_() % uint32_t(kEdge - 3)); };
    const Vec3i low{place(), place(), place()};
    test::VoxelMap voxels = test::randomVoxels(lattice_.type, {low, low + Vec3i{3, 3, 3}}, 6, 0, random_);
    renderer_.update(test::changesOf(lattice_.type, voxels));
    dispatch(lattice_.type, [&]<class T>() {
      for (const auto& [v, value] : voxels) {
        const Vec3i in = v - leafOriginOf(v);
        const auto leaf = size_t(field_.findLeaf(leafOriginOf(v)));
        valuesAs<T>(field_.values)[leaf * kLeafVoxels + size_t(leafOffset(in.x, in.y, in.z))] = T(value);
      }
    });
  }

  void expectFresh(int step) {
    DifferentialRenderer fresh(lattice_, settingsFor(lattice_), {.method = Method::full, .threads = 1});
    fresh.start(field_);
    EXPECT_TRUE(test::imagesEqualBitForBit(renderer_.image(), fresh.image())) << "step " << step;
    EXPECT_TRUE(test::imagesEqualBitForBit(renderer_.depth(), fresh.depth())) << "step " << step;
  }

  uint64_t memory() const { return renderer_.memoryBytes(); }
  uint64_t integrated() const { return renderer_.statistics().segmentsRecast; }

 private:
  Lattice lattice_;
  DifferentialRenderer renderer_;
  Field field_;
  std::mt19937 random_{11};
};

class LongChain : public testing::TestWithParam<ElementType> {};

TEST_P(LongChain, OfTenThousandStepsEqualsAFreshRenderAndKeepsItsMemory) {
  Chain chain(GetParam());
  uint64_t memory = 0, integrated = 0;
  size_t heap = 0;
  for (int step = 1; step <= kSteps; ++step) {
    chain.step();
    integrated += chain.integrated();
    if (step == kSteps / 10) {
      memory = chain.memory();
      heap = heapInUse();
    }
    if (step % 2500 == 0) chain.expectFresh(step);
  }
  EXPECT_GT(integrated, uint64_t(kSteps)) << "hardly a step changed anything";
  EXPECT_EQ(chain.memory(), memory);
  // Scratch of the test and of the renderer moves by a few pages; 16 bytes a step would be 144 kB.
  EXPECT_LT(heapInUse(), heap + 64 * 1024);
}

INSTANTIATE_TEST_SUITE_P(Types, LongChain, testing::Values(ElementType::u8, ElementType::f32),
                         [](const auto& type) { return std::string(name(type.param)); });

}  // namespace
}  // namespace kairos
