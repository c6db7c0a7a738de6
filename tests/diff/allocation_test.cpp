// A steady state asks for no memory. A program of its own, since it replaces operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <random>

#include "diff/differential_renderer.h"
#include "support/changes.h"
#include "support/scenes.h"

namespace {

std::atomic<uint64_t> allocations{0};

void* counted(void* memory) {
  if (!memory) throw std::bad_alloc();
  allocations.fetch_add(1, std::memory_order_relaxed);
  return memory;
}

}  // namespace

// The other forms of operator new call these two.
void* operator new(size_t bytes) {
  return counted(std::malloc(bytes > 0 ? bytes : 1));
}
void* operator new(size_t bytes, std::align_val_t alignment) {
  const auto a = size_t(alignment);
  return counted(std::aligned_alloc(a, (bytes + a - 1) / a * a));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace kairos {
namespace {

// Changes to other values and back, as often as one likes: some bricks empty and fill again.
struct ThereAndBack {
  ChangedVoxels there, back;
  ThereAndBack(const test::Scene& scene) {
    std::mt19937 random(5);
    const ElementType type = scene.lattice.type;
    const auto voxels = test::randomVoxels(type, scene.lattice.domain, 4000, 0, random);
    test::VoxelMap before;
    for (const auto& [v, value] : voxels) before[v] = scene.field.value(v);
    there = test::changesOf(type, voxels);
    back = test::changesOf(type, before);
  }
};

// How many allocations the later ones of many rounds of `there` and `back` make.
template <class Apply>
uint64_t allocationsOfSteadyState(const ThereAndBack& steps, Apply&& apply) {
  const auto round = [&] {
    apply(steps.there);
    apply(steps.back);
  };
  for (int i = 0; i < 3; ++i) round();
  const uint64_t before = allocations;
  for (int i = 0; i < 3; ++i) round();
  return allocations - before;
}

TEST(Allocations, AreCounted) {
  const uint64_t before = allocations;
  const auto volume = std::make_unique<std::vector<float>>(1000);
  EXPECT_EQ(allocations - before, 2u) << volume->size();
}

class SteadyState : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, SteadyState, testing::ValuesIn(test::kAllTypes),
                         [](const auto& type) { return std::string(name(type.param)); });

TEST_P(SteadyState, OfTheVolumeAllocatesNothing) {
  for (const auto& scene : {test::plume(GetParam()), test::denseNoise(GetParam())}) {
    ThreadPool pool(1);
    BrickVolume volume(scene.lattice, scene.field, pool);
    EXPECT_EQ(
        allocationsOfSteadyState(ThereAndBack(scene), [&](const ChangedVoxels& c) { volume.apply(c, pool); }),
        0u)
        << scene.name;
  }
}

TEST_P(SteadyState, OfUpdateCastAndComposeAllocatesNothing) {
  const test::Scene scene = test::plume(GetParam());
  for (const Method method : {Method::full, Method::segments})
    for (const uint64_t cacheMemory : {uint64_t(0), uint64_t(1) << 30})
      for (const bool depth : {false, true}) {
        RenderSettings settings = test::settingsFor(scene, "iso", test::softTransferFunction(GetParam()));
        settings.depth = depth;
        RendererOptions options;
        options.method = method;
        options.threads = 1;
        options.cacheMemory = cacheMemory;
        DifferentialRenderer renderer(scene.lattice, settings, options);
        renderer.start(scene.field);
        EXPECT_EQ(allocationsOfSteadyState(ThereAndBack(scene),
                                           [&](const ChangedVoxels& c) { renderer.update(c); }),
                  0u)
            << int(method) << " " << cacheMemory << " " << depth;
        EXPECT_GT(renderer.statistics().samples, 0u);
      }
}

}  // namespace
}  // namespace kairos
