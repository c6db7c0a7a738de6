#include "sequences.h"

#include <cmath>
#include <limits>
#include <random>

namespace kairos::test {

std::vector<ChangedVoxels> Sequence::changes() const {
  ThreadPool pool(1);
  ChangeDetector detector(steps.front(), 0);
  std::vector<ChangedVoxels> list;
  for (size_t i = 1; i < steps.size(); ++i) list.push_back(detector.advance(steps[i], pool));
  return list;
}

Field fieldOf(const Lattice& lattice, const VoxelMap& voxels) {
  Field field;
  field.background = lattice.background;
  field.bounds = lattice.domain;
  field.values = makeVoxelArray(lattice.type);
  applyChanges(changesOf(lattice.type, voxels), field);
  return field;
}

VoxelMap filled(const VoxelBox& box, double value) {
  VoxelMap voxels;
  for (int z = box.lo.z; z < box.hi.z; ++z)
    for (int y = box.lo.y; y < box.hi.y; ++y)
      for (int x = box.lo.x; x < box.hi.x; ++x) voxels[{x, y, z}] = value;
  return voxels;
}

namespace {

template <class MakeScene>
Sequence sceneSequence(const char* name, int steps, MakeScene&& sceneAt) {
  Sequence sequence{name, sceneAt(0).lattice, {}};
  for (int step = 0; step < steps; ++step) sequence.steps.push_back(sceneAt(step).field);
  return sequence;
}

// Applies `changesAt(step)` one after the other.
template <class ChangesAt>
Sequence changeSequence(const char* name, const Scene& first, int steps, ChangesAt&& changesAt) {
  Sequence sequence{name, first.lattice, {first.field}};
  for (int step = 1; step < steps; ++step) {
    Field next = sequence.steps.back();
    applyChanges(changesOf(first.lattice.type, changesAt(step)), next);
    sequence.steps.push_back(std::move(next));
  }
  return sequence;
}

}  // namespace

Sequence frontSequence(ElementType type) {
  return sceneSequence("front", 9, [&](int step) { return travellingFront(type, 44, 2.5 * step); });
}

Sequence ballSequence(ElementType type) {
  return sceneSequence("ball", 7, [&](int step) { return movingBall(type, 44, 2.0 * step); });
}

Sequence blockSequence(ElementType type) {
  std::mt19937 random(5);
  const Vec3i dims{60, 41, 50};
  const Lattice lattice = sparseLattice(type, dims, {-20, 7, -9});
  std::uniform_int_distribution<int> oneIn(0, 2);
  std::uniform_real_distribution<double> unit(0.1, 1);
  Sequence sequence{"blocks", lattice, {}};
  for (int step = 0; step < 8; ++step) {
    VoxelMap voxels;
    const int edge = step % 3 == 0 ? 16 : step % 3 == 1 ? 8 : 5;
    for (int z = 0; z < dims.z; z += edge)
      for (int y = 0; y < dims.y; y += edge)
        for (int x = 0; x < dims.x; x += edge) {
          if (oneIn(random) != 0 || step == 7) continue;
          const double value = std::round(unit(random) * 250) / 255 * fullScale(type);
          for (int i = 0; i < edge * edge * edge; i += 1 + step % 2) {
            const Vec3i v = lattice.domain.lo + Vec3i{x + i % edge, y + i / edge % edge, z + i / edge / edge};
            if (lattice.domain.contains(v)) voxels[v] = type == ElementType::f32 ? value : std::floor(value);
          }
        }
    sequence.steps.push_back(fieldOf(lattice, voxels));
  }
  return sequence;
}

Sequence flickerSequence(ElementType type) {
  const Scene first = plume(type, 44);
  const VoxelBox box = first.lattice.domain;
  std::mt19937 random(11);
  return changeSequence("flicker", first, 9, [&](int step) {
    VoxelMap voxels = randomVoxels(type, box, 3, 0, random);
    const double value = step % 2 ? fullScale(type) : 0;
    voxels[step % 4 < 2 ? box.lo : box.hi - Vec3i{1, 1, 1}] = value;
    const Vec3i onFace{floorToMultiple(box.lo.x + 20, 8), floorToMultiple(box.lo.y + 20, 8),
                       floorToMultiple(box.lo.z + 20, 8)};
    voxels[onFace + Vec3i{step % 3, 0, step % 2} * 4] = value;
    return voxels;
  });
}

Sequence scatterSequence(ElementType type) {
  const Scene first = denseNoise(type, 36);
  std::mt19937 random(7);
  return changeSequence("scatter", first, 6, [&](int) {
    return randomVoxels(type, first.lattice.domain, size_t(first.lattice.domain.voxelCount() / 30), 0,
                        random);
  });
}

Sequence noiseSequence(ElementType type) {
  return sceneSequence("noise", 4, [&](int step) { return denseNoise(type, 36, uint32_t(step + 1)); });
}

Sequence pulseSequence(ElementType type) {
  return sceneSequence("pulse", 6, [&](int step) {
    Scene scene = plume(type, 40, step);
    if (step % 2 == 0) scene.field = fieldOf(scene.lattice, {});
    return scene;
  });
}

Sequence nonFiniteSequence() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double odd[] = {
      std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity, -0.0, 1e30, -1e30, 1e-42};
  const Scene first = plume(ElementType::f32, 40);
  std::mt19937 random(13);
  return changeSequence("nonFinite", first, 7, [&](int step) {
    VoxelMap voxels = randomVoxels(ElementType::f32, first.lattice.domain, 400, 0, random);
    for (auto& [v, value] : voxels)
      value = step % 2 ? odd[size_t(v.x + v.y + v.z + 1000) % std::size(odd)] : std::abs(value) / 10;
    return voxels;
  });
}

std::vector<Sequence> allSequences() {
  return {
      frontSequence(ElementType::u8),  ballSequence(ElementType::f32),   blockSequence(ElementType::u16),
      blockSequence(ElementType::u8),  flickerSequence(ElementType::u8), scatterSequence(ElementType::f32),
      noiseSequence(ElementType::u16), pulseSequence(ElementType::f32),  nonFiniteSequence()};
}

RendererOptions withMethod(Method method, int threads) {
  RendererOptions options;
  options.method = method;
  options.threads = threads;
  return options;
}

FramePair::FramePair(const Lattice& lattice, const RenderSettings& settings, RendererOptions segments,
                     int fullThreads)
    : depth_(settings.depth),
      segments_(lattice, settings, segments),
      full_(lattice, settings, withMethod(Method::full, fullThreads)) {}

testing::AssertionResult FramePair::start(const Field& field) {
  segments_.start(field);
  full_.start(field);
  return compare();
}

testing::AssertionResult FramePair::update(const ChangedVoxels& changes) {
  segments_.update(changes);
  full_.update(changes);
  return compare();
}

testing::AssertionResult FramePair::compare() const {
  const auto colour = imagesEqualBitForBit(segments_.image(), full_.image());
  if (!colour || !depth_) return colour;
  const auto depth = imagesEqualBitForBit(segments_.depth(), full_.depth());
  if (!depth) return testing::AssertionFailure() << "depth: " << depth.message();
  return depth;
}

testing::AssertionResult framesAreEqual(const Sequence& sequence, const RenderSettings& settings,
                                        const RendererOptions& segments, size_t from) {
  FramePair pair(sequence.lattice, settings, segments);
  if (const auto same = pair.start(sequence.steps[from]); !same)
    return testing::AssertionFailure() << "first frame, step " << from << ": " << same.message();
  const std::vector<ChangedVoxels> changes = sequence.changes();
  for (size_t step = from + 1; step < sequence.steps.size(); ++step)
    if (const auto same = pair.update(changes[step - 1]); !same)
      return testing::AssertionFailure() << "step " << step << ": " << same.message();
  return testing::AssertionSuccess();
}

}  // namespace kairos::test
