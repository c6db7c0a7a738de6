// Whole 512x512 frames: what skipping costs where there is nothing to skip, and what a second thread brings.
// Frames without skipping have the bits of those with it, which is verified first.
#include <benchmark/benchmark.h>

#include <string>

#include "diff/differential_renderer.h"
#include "scenes.h"

namespace {

using namespace kairos;

struct NamedScene {
  const char* name;
  const std::vector<uint8_t>& (*values)();
  RenderSettings (*settings)(ElementType);
};

void castFrames(benchmark::State& state, const NamedScene& scene, ElementType type, bool skip, int threads) {
  const Field field = bench::fieldOf(scene.values(), type);
  RenderSettings settings = scene.settings(type);
  DifferentialRenderer other(bench::lattice(type), settings, bench::rendererOptions(Method::full, 2));
  const Image expected = other.start(field);
  settings.skipInvisible = skip;
  DifferentialRenderer renderer(bench::lattice(type), settings,
                                bench::rendererOptions(Method::full, threads));
  if (renderer.start(field) != expected) return state.SkipWithError("not the bits of another configuration");
  ChangedVoxels none;
  none.values = makeVoxelArray(type);
  for (auto _ : state) benchmark::DoNotOptimize(renderer.update(none).data.data());
  state.counters["Msamples"] = double(renderer.statistics().samples) / 1e6;
}

const bool registered = [] {
  for (const NamedScene& scene : {NamedScene{"noise", bench::noise, bench::settings},
                                  NamedScene{"plume", bench::plume, bench::settings},
                                  NamedScene{"fog", bench::fog, bench::fogSettings}})
    for (ElementType type : {ElementType::u8, ElementType::f32}) {
      const auto add = [&](const char* label, bool skip, int threads) {
        const std::string title = std::string(scene.name) + "/" + std::string(name(type)) + "/" + label;
        benchmark::RegisterBenchmark(title.c_str(), castFrames, scene, type, skip, threads)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      };
      add("skipping", true, 1);
      add("no_skipping", false, 1);
      add("two_threads", true, 2);
    }
  return true;
}();

}  // namespace
