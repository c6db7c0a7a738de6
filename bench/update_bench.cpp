// What a step costs against a full frame of the same state, one thread: coherent and scattered changes,
// translucent and opaque, with and without reading the differential file, in turn or, as `kairos render` does
// it, on another processor while the step before is rendered. Every pair of steps (there and back) is first
// verified to give the bits of full renders. Reading, and updating the bricks, also by themselves.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <future>

#include "diff/differential_renderer.h"
#include "io/sequence.h"
#include "raycast/occupancy.h"
#include "scenes.h"

namespace {

using namespace kairos;

enum class Change { ball2, ball5, scattered };

enum class Reading { none, inTurn, ahead };

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
  Steps(const std::vector<uint8_t>& values, Change change, ElementType type)
      : before(bench::fieldOf(values, type)), after(before) {
    there = changeOf(before, change);
    applyChanges(there, after);
    back = there;
    dispatch(type, [&]<class T>() {
      auto& old = valuesAs<T>(back.values);
      for (uint64_t i = 0; i < back.count(); ++i) old[i] = T(before.value(back.locate(i)));
    });
  }
};

// The steps as a sequence on disk, which goes when this does: before, there, back.
class StepsOnDisk {
 public:
  explicit StepsOnDisk(const Steps& steps)
      : directory_(std::filesystem::temp_directory_path() /
                   ("kairos-update-bench-" + std::to_string(::getpid()))) {
    SequenceManifest manifest;
    manifest.lattice = bench::lattice(steps.before.type());
    manifest.inputs = {"before", "there", "back"};
    SequenceWriter writer(directory_, manifest, true);
    const uint64_t before = stateChecksum(steps.before), after = stateChecksum(steps.after);
    const auto write = [&](int64_t step, uint64_t state, const Field* key, const ChangedVoxels* changes) {
      SequenceStep entry;
      entry.step = step;
      entry.stateChecksum = state;
      entry.changedVoxels = changes ? changes->count() : 0;
      writer.write(entry, key, changes);
    };
    write(0, before, &steps.before, nullptr);
    write(1, after, nullptr, &steps.there);
    write(2, before, nullptr, &steps.back);
    writer.finish();
    reader_.emplace(directory_);
  }
  ~StepsOnDisk() { std::filesystem::remove_all(directory_); }

  // There and back in turn. As they come from `before` to `after` again and again, their checksums fit.
  ChangedVoxels read(bool forth) const { return reader_->readChanges(forth ? 1 : 2); }
  uint64_t bytes() const { return reader_->bytes(1); }

 private:
  std::string directory_;
  std::optional<SequenceReader> reader_;
};

void read(benchmark::State& state, const Case& c) {
  const StepsOnDisk files(Steps(c.scene(), c.change, ElementType::f32));
  bool forth = true;
  for (auto _ : state) {
    benchmark::DoNotOptimize(files.read(forth).leaves.data());
    forth = !forth;
  }
  state.counters["MB"] = double(files.bytes()) / 1e6;
}

// Bricks, aprons, value ranges, windows and visibility, as a step does it.
void apply(benchmark::State& state, ElementType type) {
  const Steps steps(bench::noise(), Change::ball5, type);
  ThreadPool pool(1);
  BrickVolume volume(bench::lattice(type), steps.before, pool);
  const RenderSettings settings = bench::settings(type);
  const ClassificationTable table = settings.classification(volume.lattice());
  Occupancy occupancy(settings, table);
  occupancy.build(volume);
  std::vector<uint8_t> visibleBefore;
  bool forth = true;
  for (auto _ : state) {
    occupancy.update(volume, volume.apply(forth ? steps.there : steps.back, pool), visibleBefore);
    forth = !forth;
  }
  state.counters["voxels"] = double(steps.there.count());
  state.counters["bricks"] = double(visibleBefore.size());
}

void step(benchmark::State& state, const Case& c, Method method, Reading reading) {
  static const Lattice lattice = bench::lattice(ElementType::f32);
  const Steps steps(c.scene(), c.change, ElementType::f32);
  std::optional<StepsOnDisk> files;
  if (reading != Reading::none) files.emplace(steps);
  DifferentialRenderer renderer(lattice, settingsOf(c), bench::rendererOptions(method));
  renderer.start(steps.before);
  renderer.update(steps.there);
  DifferentialRenderer whole(lattice, settingsOf(c), bench::rendererOptions(Method::full));
  if (!sameBits(renderer.image(), whole.start(steps.after)))
    return state.SkipWithError("not the bits of a full render");
  renderer.update(steps.back);
  bool forth = true;
  double update = 0, select = 0, cast = 0;
  const auto readAhead = [&](bool there) {
    return std::async(std::launch::async, [&files, there] { return files->read(there); });
  };
  std::future<ChangedVoxels> next;
  if (reading == Reading::ahead) next = readAhead(forth);
  for (auto _ : state) {
    if (reading == Reading::ahead) {
      const ChangedVoxels changes = next.get();
      next = readAhead(!forth);
      renderer.update(changes);
    } else if (reading == Reading::inTurn) {
      renderer.update(files->read(forth));
    } else {
      renderer.update(forth ? steps.there : steps.back);
    }
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
    const std::string title = name;
    const auto ms = [](auto* b) { b->Unit(benchmark::kMillisecond); };
    ms(benchmark::RegisterBenchmark((title + "/full").c_str(), step, c, Method::full, Reading::none));
    ms(benchmark::RegisterBenchmark((title + "/segments").c_str(), step, c, Method::segments, Reading::none));
    ms(benchmark::RegisterBenchmark((title + "/read").c_str(), read, c));
    ms(benchmark::RegisterBenchmark((title + "/read_and_segments").c_str(), step, c, Method::segments,
                                    Reading::inTurn));
    ms(benchmark::RegisterBenchmark((title + "/segments_reading_ahead").c_str(), step, c, Method::segments,
                                    Reading::ahead)
           ->UseRealTime());
  };
  for (ElementType type : {ElementType::u8, ElementType::u16, ElementType::f32})
    benchmark::RegisterBenchmark(("apply_5_percent/" + std::string(name(type))).c_str(), apply, type)
        ->Unit(benchmark::kMillisecond);
  add("noise_ball_5_percent", {bench::noise, Change::ball5, false});
  add("noise_ball_5_percent_opaque", {bench::noise, Change::ball5, true});
  add("noise_scattered", {bench::noise, Change::scattered, false});
  add("plume_ball_2_percent", {bench::plume, Change::ball2, false});
  return true;
}();

}  // namespace
