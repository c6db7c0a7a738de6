#include "accuracy_scenes.h"

#include <algorithm>
#include <cmath>

#include "io/input_series.h"
#include "scenes.h"

namespace kairos::bench {
namespace {

TransferFunction softFunction() {
  std::vector<TransferFunction::ColourPoint> colours;
  std::vector<TransferFunction::OpacityPoint> opacities;
  for (int i = 0; i < 256; ++i) {
    const double t = i / 255.0;
    colours.push_back(
        {t, {std::min(1.5 * t, 1.0), std::clamp(1.6 * t - 0.3, 0.0, 1.0), 0.4 + 0.4 * std::sin(6 * t)}});
    opacities.push_back({t, 0.25 * std::pow(std::max(0.0, (t - 0.12) / 0.88), 1.5)});
  }
  return {colours, opacities};
}

TransferFunction bandFunction() {
  return {{{0, {0.1, 0.2, 0.9}}, {0.35, {0.2, 0.8, 0.9}}, {0.6, {1, 0.6, 0.1}}, {1, {1, 1, 0.9}}},
          {{0, 0},
           {0.28, 0},
           {0.29, 0.12},
           {0.33, 0.12},
           {0.34, 0},
           {0.58, 0},
           {0.59, 0.4},
           {0.63, 0.4},
           {0.64, 0},
           {1, 0}}};
}

constexpr size_t kEarlier = 3;  // time steps

AccuracyScene procedural(const std::string& name, const std::vector<uint8_t>& values, ElementType type) {
  return {name + "/" + std::string(kairos::name(type)), lattice(type), fieldOf(values, type), {0, 255}, {}};
}

AccuracyScene swayingPlume(ElementType type) {
  constexpr float kSway = 0.02f;  // a third of a voxel a step
  AccuracyScene scene = procedural("plume", plume(), type);
  for (size_t step = kEarlier; step > 0; --step)
    scene.before.push_back(fieldOf(plumeAt(-kSway * float(step)), type));
  return scene;
}

// `prefix` and a time step of four digits are a file's path.
AccuracyScene fromSeries(const std::string& name, const std::string& prefix, int step,
                         const std::string& suffix, const InputOptions& options) {
  std::vector<std::string> files;
  for (int s = step - int(kEarlier); s <= step; ++s) {
    const std::string digits = std::to_string(10000 + s).substr(1);
    files.push_back(prefix + digits + suffix);
  }
  const auto series = InputSeries::open(files, options);
  AccuracyScene scene{name, series->lattice(), series->read(kEarlier), {}, {}};
  for (size_t s = 0; s < kEarlier; ++s) scene.before.push_back(series->read(s));
  const FieldStatistics statistics = fieldStatistics(scene.field);
  scene.range = {float(statistics.lo), float(statistics.hi)};
  return scene;
}

}  // namespace

RenderSettings AccuracyScene::settings(Classification classification) const {
  RenderSettings settings;
  settings.transferFunction =
      (classification == Classification::soft ? softFunction() : bandFunction()).stretchedTo(range);
  settings.range = range;
  settings.camera = fittedCamera("iso", lattice.worldBounds(), 30, 1);
  // Small volumes get the opacity that 256 voxels have.
  const Vec3i size = lattice.domain.size();
  settings.unitDistance = lattice.worldFromIndex.voxelSize() * std::max({size.x, size.y, size.z}) / 256.0;
  settings.terminate = 0.9999f;
  return settings;
}

std::vector<AccuracyScene> accuracyScenes(const std::string& dataDirectory) {
  std::vector<AccuracyScene> scenes;
  for (const ElementType type : {ElementType::u8, ElementType::f32}) {
    scenes.push_back(swayingPlume(type));
    scenes.push_back(procedural("noise", noise(), type));
  }
  if (dataDirectory.empty()) return scenes;
  InputOptions raw;
  raw.raw = RawFormat{{101, 49, 81}, ElementType::u8, {0.125, 0.125, 0.125}};
  scenes.push_back(fromSeries("jet2/u8", dataDirectory + "/jets/jet2/jet2_", 80, ".raw", raw));
  InputOptions density;
  density.grid = "density";
  scenes.push_back(fromSeries("smoke/f32", dataDirectory + "/smoke/fluid_data_", 50, ".vdb", density));
  return scenes;
}

}  // namespace kairos::bench
