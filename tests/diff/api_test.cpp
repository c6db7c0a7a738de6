// The snippets of docs/api.md, compiled and run; the last test checks that they are the same text.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "core/colour_map.h"
#include "core/error.h"
#include "core/srgb.h"
#include "sequences.h"

namespace kairos::test {
namespace {

TEST(Documentation, TheShortestUse) {
  const int nx = 20, ny = 18, nz = 16, steps = 3;
  std::vector<float> array(size_t(nx * ny * nz));
  const auto simulate = [&](int step) {
    for (size_t i = 0; i < array.size(); ++i) array[i] = float(i % 97) / 97 * float(step + 1) / 3;
    return array.data();
  };
  double brightness = 0;
  const auto show = [&](const Image& image) {
    for (const float c : image.data) brightness += double(c);
  };
  // clang-format off
Lattice lattice;
lattice.type = ElementType::f32;
lattice.domain = {{0, 0, 0}, {nx, ny, nz}};
lattice.dense = true;

RenderSettings settings;
settings.camera = fittedCamera("iso", lattice.worldBounds(), 30, 1);
settings.range = {0, 1};
settings.transferFunction = builtInTransferFunction("inferno");

DifferentialRenderer renderer(lattice, settings, {});
for (int step = 0; step < steps; ++step) {
  const float* values = simulate(step);
  const Image& frame = renderer.render(values, 1.0 / 255);
  show(frame);
}
  // clang-format on
  EXPECT_GT(brightness, 0);
}

Lattice documentedLattice() {
  // clang-format off
Lattice lattice;
lattice.type = ElementType::u16;
lattice.background = 0;
lattice.domain = {{-64, -64, 0}, {64, 64, 200}};  // lo <= voxel < hi
lattice.worldFromIndex = Affine::scale({0.01, 0.01, 0.02});
lattice.worldFromIndex.translation = {0, 0, -1};
  // clang-format on
  return lattice;
}

RenderSettings documentedSettings() {
  // clang-format off
RenderSettings settings;
settings.width = 800;
settings.height = 600;
settings.camera.eye = {3, -4, 2};
settings.camera.target = {0, 0, 1};
settings.camera.up = {0, 0, 1};
settings.camera.verticalFovDegrees = 35;
settings.range = {0, 4000};
settings.transferFunction = {{{0, {0.1, 0.2, 0.9}}, {4000, {1, 0.9, 0.6}}},   // value, linear colour
                             {{0, 0}, {500, 0}, {4000, 0.3}}};                // value, opacity over one unit distance
settings.unitDistance = 0.01;  // in world units; 0: one voxel
settings.step = 0.5;           // distance between samples, in voxels
settings.shade = true;
  // clang-format on
  return settings;
}

TEST(Documentation, LatticeFieldAndSettings) {
  const Lattice lattice = documentedLattice();
  const int nx = 128, ny = 128, nz = 200;
  const std::vector<uint16_t> values(size_t(nx) * ny * nz, 3000);
  // clang-format off
Field field = fieldFromDense(values.data(), {nx, ny, nz}, uint16_t(0), lattice.domain.lo);
  // clang-format on
  DifferentialRenderer renderer(lattice, documentedSettings(), {});
  EXPECT_TRUE(renderer.seesVolume());
  renderer.start(field);
  EXPECT_GT(renderer.statistics().samples, 0u);
}

TEST(Documentation, FieldsAndChanges) {
  const Sequence sequence = ballSequence(ElementType::f32);
  DifferentialRenderer renderer(
      sequence.lattice, settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::f32)), {});
  const Field& first = sequence.steps[0];
  const double tolerance = 0;
  size_t step = 0;
  const auto nextStep = [&]() -> std::optional<Field> {
    if (++step == sequence.steps.size()) return std::nullopt;
    return sequence.steps[step];
  };
  int shown = 0;
  const auto show = [&](const Image&) { ++shown; };
  // clang-format off
ThreadPool pool(2);
ChangeDetector detector(first, tolerance);
renderer.start(first);
while (const std::optional<Field> next = nextStep()) {
  const ChangedVoxels changes = detector.advance(*next, pool);
  show(renderer.update(changes));
}
  // clang-format on
  EXPECT_EQ(shown + 1, int(sequence.steps.size()));
  EXPECT_EQ(renderer.state(), stateChecksum(sequence.steps.back()));
}

TEST(Documentation, ASolverThatKnowsItsChangesAndWhatAFrameTook) {
  const Lattice lattice = denseLattice(ElementType::f32, {64, 64, 64});
  const RenderSettings settings = settingsFor({"", lattice, {}}, "x", softTransferFunction(ElementType::f32));
  DifferentialRenderer renderer(lattice, settings, {});
  renderer.start(fieldOf(lattice, {}));
  const auto changed = [](const Vec3i& v) { return (v.x + v.y * v.z) % 3 == 0; };
  const auto newValue = [](const Vec3i& v) { return float(v.x + v.y + v.z) / 100; };
  // clang-format off
ChangedVoxels changes;
std::vector<float> values;
ChangedLeaf leaf;
leaf.origin = leafOriginOf({40, 23, 16});  // multiples of 8: (40, 16, 16)
leaf.first = values.size();
for (int z = 0; z < 8; ++z)
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      if (!changed(leaf.origin + Vec3i{x, y, z})) continue;
      leaf.mask[size_t(z)] |= uint64_t(1) << (x + 8 * y);
      values.push_back(newValue(leaf.origin + Vec3i{x, y, z}));
    }
if (leaf.count() > 0) changes.leaves.push_back(leaf);
changes.values = std::move(values);  // of the lattice's type, even when there are none
renderer.update(changes);
  // clang-format on
  VoxelMap expected;
  for (int i = 0; i < 512; ++i) {
    const Vec3i v = Vec3i{40, 16, 16} + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
    if (changed(v)) expected[v] = double(newValue(v));
  }
  DifferentialRenderer full(lattice, settings, withMethod(Method::full));
  EXPECT_TRUE(imagesEqualBitForBit(renderer.image(), full.start(fieldOf(lattice, expected))));
  EXPECT_GT(renderer.statistics().pixelsChanged, 0u);
  // clang-format off
const FrameStatistics& s = renderer.statistics();
std::printf("%llu of %llu segments integrated, %llu samples, %.1f ms\n", (unsigned long long)s.segmentsRecast,
            (unsigned long long)s.segmentsTotal, (unsigned long long)s.samples,
            s.updateMs + s.selectMs + s.castMs + s.composeMs);
  // clang-format on
}

TEST(Documentation, ImagesErrorsAndOptions) {
  const Sequence sequence = ballSequence(ElementType::u8);
  const Lattice lattice = sequence.lattice;
  const RenderSettings settings = settingsFor(sequence.scene(), "x", softTransferFunction(ElementType::u8));
  // clang-format off
RendererOptions options;
options.threads = 2;                       // 0: all
options.cacheMemory = uint64_t(512) << 20; // bytes for the segments' results
DifferentialRenderer renderer(lattice, settings, options);
  // clang-format on
  const ChangedVoxels changes = sequence.changes()[1];
  const auto wholeStep = [&] { return sequence.steps[2]; };
  std::string reported;
  const auto report = [&](const char* what) { reported = what; };
  // clang-format off
try {
  renderer.update(changes);
} catch (const StateError& e) {  // not the changes of this state, wrong element type, outside the domain
  renderer.start(wholeStep());
} catch (const Error& e) {
  report(e.what());
}
  // clang-format on
  EXPECT_EQ(reported, "");
  EXPECT_EQ(renderer.state(), stateChecksum(sequence.steps[2]));
  const int x = 20, y = 20;
  // clang-format off
const Image& image = renderer.image();
const float* pixel = image.pixel(x, y);
const double red = srgbFromLinear(displayed(pixel[0]));
  // clang-format on
  EXPECT_GE(red, 0);
  EXPECT_LE(red, 1);
}

std::string fileText(const char* path) {
  std::ifstream file(KAIROS_SOURCE_DIR + std::string(path));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(Documentation, ShowsTheCodeOfTheseTests) {
  const std::string document = fileText("/docs/api.md"),
                    tests = fileText("/tests/diff/api_test.cpp") + fileText("/tests/tcdvrm/api_test.cpp") +
                            fileText("/tests/lod/api_test.cpp");
  const std::string fence = "```cpp\n";
  int snippets = 0;
  for (size_t at = document.find(fence); at != std::string::npos; at = document.find(fence, at)) {
    at += fence.size();
    const std::string snippet = document.substr(at, document.find("```", at) - at);
    EXPECT_THAT(tests, testing::HasSubstr(snippet));
    ++snippets;
  }
  EXPECT_GE(snippets, 9);
}

}  // namespace
}  // namespace kairos::test
