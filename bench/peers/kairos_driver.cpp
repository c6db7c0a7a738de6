// Kairos as a driver of the peer comparison (see driver.h): whole frames of one scene, every ray cast anew.
//
//     kairos_driver SCENE.json [--threads N] [--precision full|fast] [--isa NAME] [--kernel fastest|general]
//                   [--step S] [--terminate A] [--double]
//     kairos_driver --convert IMAGE.exr IMAGE.raw
//
// --double is the scalar reference in double precision, slow. --convert rewrites an image as raw float32.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "diff/differential_renderer.h"
#include "driver.h"
#include "io/image_file.h"
#include "raycast/reference_caster.h"

using namespace kairos;

namespace {

struct Arguments {
  std::string scene;
  int threads = 1;
  Precision precision = Precision::full;
  Isa isa = Isa::automatic;
  Kernel kernel = Kernel::fastest;
  double step = 0;  // 0: the scene's
  float terminate = -1;
  bool reference = false;
  std::vector<std::string> convert;
};

void addOptions(CLI::App& app, Arguments& a) {
  const auto isas = [] {
    std::map<std::string, Isa> names{{"auto", Isa::automatic}};
    for (Isa isa : supportedIsas()) names[name(isa)] = isa;
    return names;
  }();
  app.add_option("scene", a.scene);
  app.add_option("--threads", a.threads);
  app.add_option("--precision", a.precision)
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Precision>{{"full", Precision::full}, {"fast", Precision::fast}}));
  app.add_option("--isa", a.isa)->transform(CLI::CheckedTransformer(isas));
  app.add_option("--kernel", a.kernel)
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Kernel>{{"fastest", Kernel::fastest}, {"general", Kernel::general}}));
  app.add_option("--step", a.step);
  app.add_option("--terminate", a.terminate);
  app.add_flag("--double", a.reference);
  app.add_option("--convert", a.convert)->expected(2);
}

Lattice latticeOf(const bench::Scene& scene) {
  Lattice lattice;
  lattice.type = scene.type == "u8" ? ElementType::u8 : ElementType::f32;
  lattice.domain = {{0, 0, 0}, scene.dims};
  lattice.dense = true;
  return lattice;
}

Field fieldOf(const bench::Scene& scene) {
  if (scene.type == "u8") return fieldFromDense(bench::readVoxels<uint8_t>(scene).data(), scene.dims);
  return fieldFromDense(bench::readVoxels<float>(scene).data(), scene.dims);
}

RenderSettings settingsOf(const bench::Scene& scene, const Arguments& a) {
  RenderSettings s;
  s.camera = scene.camera;
  s.width = scene.width;
  s.height = scene.height;
  s.transferFunction = scene.transferFunction;
  s.range = scene.range;
  s.unitDistance = 1;
  s.step = a.step > 0 ? a.step : scene.step;
  s.terminate = a.terminate >= 0 ? a.terminate : scene.terminate;
  s.precision = a.precision;
  s.isa = a.isa;
  s.kernel = a.kernel;
  return s;
}

void drive(const Arguments& a) {
  const bench::Scene scene = bench::readScene(a.scene);
  const RenderSettings settings = settingsOf(scene, a);
  RendererOptions options;
  options.method = Method::full;
  options.threads = a.threads;
  DifferentialRenderer renderer(latticeOf(scene), settings, options);
  renderer.start(fieldOf(scene));
  ChangedVoxels none;
  none.values = makeVoxelArray(renderer.volume().lattice().type);
  std::vector<double> reference;
  const nlohmann::json description{{"name", "Kairos"}, {"version", KAIROS_VERSION}};
  if (a.reference)
    bench::serve(
        description, [&] { reference = castReference(settings, renderer.volume()); },
        [&] { return std::vector<float>(reference.begin(), reference.end()); });
  else
    bench::serve(
        description, [&] { renderer.update(none); }, [&] { return renderer.image().data; });
}

}  // namespace

int main(int argc, char** argv) try {
  Arguments arguments;
  CLI::App app("Kairos as a driver of the peer comparison");
  addOptions(app, arguments);
  CLI11_PARSE(app, argc, argv);
  if (arguments.convert.size() == 2)
    bench::writeRaw(arguments.convert[1], readImage(arguments.convert[0]).data);
  else
    drive(arguments);
  return 0;
} catch (const std::exception& e) {
  std::cerr << "kairos_driver: " << e.what() << '\n';
  return 1;
}
