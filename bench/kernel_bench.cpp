// Nanoseconds per sample of every kernel, element type and instruction set, one thread, whole 512x512 frames
// of a dense volume (nothing skipped but by early termination) and of a sparse one. Each is first verified
// against the double-precision reference.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "diff/differential_renderer.h"
#include "raycast/reference_caster.h"
#include "scenes.h"

namespace {

using namespace kairos;

// Largest difference of a small image to the reference.
double errorOf(const Field& field, RenderSettings settings, const RendererOptions& options) {
  settings.width = settings.height = 64;
  settings.camera.verticalFovDegrees /= 8;  // the benchmark's own pixel pitch, in the middle of its view
  DifferentialRenderer renderer(bench::lattice(field.type()), settings, options);
  const Image& image = renderer.start(field);
  const std::vector<double> reference = castReference(settings, renderer.volume());
  double worst = 0;
  for (size_t i = 0; i < reference.size(); ++i)
    worst = std::max(worst, std::abs(reference[i] - image.data[i]));
  return worst;
}

void castFrames(benchmark::State& state, const std::vector<uint8_t>& (*scene)(), ElementType type,
                Kernel kernel, Isa isa, Precision precision) {
  const Field field = bench::fieldOf(scene(), type);
  RenderSettings settings = bench::settings(type);
  settings.kernel = kernel;
  settings.isa = isa;
  settings.precision = precision;
  const RendererOptions options{.method = Method::full, .threads = 1};
  const double error = errorOf(field, settings, options);
  const double tolerance = precision == Precision::fast ? 3e-4 : 1e-5;
  if (error > tolerance) return state.SkipWithError(("error " + std::to_string(error)).c_str());
  DifferentialRenderer renderer(bench::lattice(type), settings, options);
  renderer.start(field);
  ChangedVoxels none;
  none.values = makeVoxelArray(type);
  for (auto _ : state) benchmark::DoNotOptimize(renderer.update(none).data.data());
  const auto samples = double(renderer.statistics().samples);
  state.counters["Msamples"] = samples / 1e6;
  state.counters["ns/sample"] = benchmark::Counter(
      samples * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["error"] = error;
}

const bool registered = [] {
  struct NamedScene {
    const char* name;
    const std::vector<uint8_t>& (*values)();
  };
  for (const NamedScene& scene : {NamedScene{"noise", bench::noise}, NamedScene{"plume", bench::plume}})
    for (ElementType type : {ElementType::u8, ElementType::u16, ElementType::f32}) {
      const auto add = [&](const char* label, Kernel kernel, Isa isa, Precision precision = Precision::full) {
        const std::string title = std::string(scene.name) + "/" + std::string(name(type)) + "/" + label;
        benchmark::RegisterBenchmark(title.c_str(), castFrames, scene.values, type, kernel, isa, precision)
            ->Unit(benchmark::kMillisecond);
      };
      add("full", Kernel::fastest, Isa::automatic);
      add("fast", Kernel::fastest, Isa::automatic, Precision::fast);
      for (Isa isa : supportedIsas()) {
        if (isa != bestIsa()) add((std::string("full_") + name(isa)).c_str(), Kernel::fastest, isa);
        add((std::string("general_") + name(isa)).c_str(), Kernel::general, isa);
      }
    }
  return true;
}();

}  // namespace
