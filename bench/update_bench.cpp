// What a step costs against a full frame of the same state, one thread: coherent and scattered changes,
// translucent and opaque. Every pair of steps (there and back) is first verified to give the bits of full
// renders.
#include <benchmark/benchmark.h>

#include <cstring>

#include "diff/differential_renderer.h"
#include "scenes.h"

namespace {

using namespace kairos;

enum class Change { ball2, ball5, scattered };

struct Case {
  const std::vector<uint8_t>& (*scene)();
  Change change;
  bool opaque;
};

ChangedVoxels changeOf(const Field& field, Change change) {
  if (change == Change::scattered) return bench::scatteredChange(field, 9);
  return bench::ballOfChange(field, {118, 120, 110}, change == Change::ball2 ? 0.02 : 0.05, 9);
}

RenderSettings settingsOf(const Case& c) {
  return c.opaque ? bench::opaqueSettings(ElementType::f32) : bench::settings(ElementType::f32);
}

bool sameBits(const Image& a, const Image& b) {
  return a.data.size() == b.data.size() &&
         std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(float)) == 0;
}

// The changes there and back between two states of the scene.
struct Steps {
  Field before, after;
  ChangedVoxels there, back;
  Steps(const Case& c) : before(bench::fieldOf(c.scene(), ElementType::f32)), after(before) {
    there = changeOf(before, c.change);
    applyChanges(there, after);
    back = there;
    auto& values = valuesAs<float>(back.values);
    for (uint64_t i = 0; i < back.count(); ++i) values[i] = float(before.value(back.locate(i)));
  }
};

void step(benchmark::State& state, const Case& c, Method method) {
  static const Lattice lattice = bench::lattice(ElementType::f32);
  const Steps steps(c);
  DifferentialRenderer renderer(lattice, settingsOf(c), {.method = method, .threads = 1});
  renderer.start(steps.before);
  renderer.update(steps.there);
  DifferentialRenderer whole(lattice, settingsOf(c), {.method = Method::full, .threads = 1});
  if (!sameBits(renderer.image(), whole.start(steps.after)))
    return state.SkipWithError("not the bits of a full render");
  renderer.update(steps.back);
  bool forth = true;
  double update = 0, select = 0, cast = 0;
  for (auto _ : state) {
    renderer.update(forth ? steps.there : steps.back);
    forth = !forth;
    update += renderer.statistics().updateMs;
    select += renderer.statistics().selectMs;
    cast += renderer.statistics().castMs;
  }
  const auto mean = [&](double sum) { return benchmark::Counter(sum, benchmark::Counter::kAvgIterations); };
  state.counters["voxels"] = double(steps.there.count());
  state.counters["Msamples"] = double(renderer.statistics().samples) / 1e6;
  state.counters["update_ms"] = mean(update);
  state.counters["select_ms"] = mean(select);
  state.counters["cast_ms"] = mean(cast);
}

const bool registered = [] {
  const auto add = [](const char* name, Case c) {
    benchmark::RegisterBenchmark((std::string(name) + "/full").c_str(), step, c, Method::full)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((std::string(name) + "/segments").c_str(), step, c, Method::segments)
        ->Unit(benchmark::kMillisecond);
  };
  add("noise_ball_5_percent", {bench::noise, Change::ball5, false});
  add("noise_ball_5_percent_opaque", {bench::noise, Change::ball5, true});
  add("noise_scattered", {bench::noise, Change::scattered, false});
  add("plume_ball_2_percent", {bench::plume, Change::ball2, false});
  return true;
}();

}  // namespace
