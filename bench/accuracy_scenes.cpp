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

AccuracyScene procedural(const std::string& name, const std::vector<uint8_t>& values, ElementType type) {
  return {name + "/" + std::string(kairos::name(type)), lattice(type), fieldOf(values, type), {0, 255}};
}

AccuracyScene fromSeries(const std::string& name, const std::string& path, const InputOptions& options) {
  const auto series = InputSeries::open({path}, options);
  AccuracyScene scene{name, series->lattice(), series->read(0), {}};
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
    scenes.push_back(procedural("plume", plume(), type));
    scenes.push_back(procedural("noise", noise(), type));
  }
  if (dataDirectory.empty()) return scenes;
  InputOptions raw;
  raw.raw = RawFormat{{101, 49, 81}, ElementType::u8, {0.125, 0.125, 0.125}};
  scenes.push_back(fromSeries("jet2/u8", dataDirectory + "/jets/jet2/jet2_0080.raw", raw));
  InputOptions density;
  density.grid = "density";
  scenes.push_back(fromSeries("smoke/f32", dataDirectory + "/smoke/fluid_data_0050.vdb", density));
  return scenes;
}

}  // namespace kairos::bench
