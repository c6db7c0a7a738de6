// Time against error: post-classified, pre-integrated and error-driven frames of several scenes, element
// types and transfer functions, each against a converged double-precision reference.
//
//     accuracy_bench OUT [DATA] [FILTER]
//
// OUT/accuracy.csv has a row a measurement, OUT/accuracy.md what each way costs at equal error, and
// OUT/accuracy-NAME.svg a plot a scene. DATA is a directory with jets/jet2 and smoke; FILTER a part of a
// scene's name. Times are the CPU time of a whole 512x512 frame on one thread, the least of several rounds;
// errors are over every twelfth tile in each direction.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "accuracy_scenes.h"
#include "diff/change_detection.h"
#include "diff/differential_renderer.h"
#include "plot/chart.h"
#include "raycast/reference_caster.h"
#include "tcdvrm/renderer_factory.h"

namespace {

using namespace kairos;
using bench::AccuracyScene;
using bench::Classification;

constexpr int kTileStride = 12, kRounds = 3;

double cpuMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e3 + double(t.tv_nsec) * 1e-6;
}

enum class Way { post, pre, error, rays };
constexpr const char* kWayNames[] = {"post-classified", "pre-integrated", "error-driven samples",
                                     "error-driven rays"};
constexpr int kWays = 4;
constexpr double kErrors[] = {3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4};
// Goals of error-driven rays, closer together: they end up anywhere between a third and all of their goal.
constexpr double kRayErrors[] = {1e-2, 5e-3, 3e-3, 2e-3, 1.5e-3, 1e-3, 3e-4, 2e-4, 1.5e-4, 1e-4};

struct Measurement {
  Way way;
  double parameter;  // sample distance, or E
  double rmse = 0, largest = 0, milliseconds = 1e30, samples = 0;
};

// A ray's four channels after the other, tile by tile.
std::vector<double> referencePixels(RenderSettings settings, const BrickVolume& volume) {
  settings.preintegrated = true;
  settings.step = 1.0 / 64;
  const ReferenceCaster caster(settings, volume);
  const ViewRays& view = caster.view();
  std::vector<double> pixels;
  TileCounters counters;
  double tile[kLanes * 4];
  for (int y = kTileStride / 2; y < view.tilesY(); y += kTileStride)
    for (int x = kTileStride / 2; x < view.tilesX(); x += kTileStride) {
      caster.cast(y * view.tilesX() + x, tile, counters);
      pixels.insert(pixels.end(), tile, tile + kLanes * 4);
    }
  return pixels;
}

std::vector<double> samePixels(const Image& image) {
  std::vector<double> pixels;
  for (int y = kTileStride / 2; y < image.height / kTileEdge; y += kTileStride)
    for (int x = kTileStride / 2; x < image.width / kTileEdge; x += kTileStride)
      for (int lane = 0; lane < kLanes; ++lane) {
        const int row = y * kTileEdge + lane / kTileEdge, column = x * kTileEdge + lane % kTileEdge;
        const float* p = &image.data[(size_t(row) * size_t(image.width) + size_t(column)) * 4];
        pixels.insert(pixels.end(), p, p + 4);
      }
  return pixels;
}

// How good an image is, over the pixels that have a reference.
void compare(const Image& image, const std::vector<double>& reference, Measurement& m) {
  const std::vector<double> pixels = samePixels(image);
  double squares = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const double difference = std::abs(pixels[i] - reference[i]);
    squares += difference * difference;
    m.largest = std::max(m.largest, difference);
  }
  m.rmse = std::sqrt(squares / double(pixels.size()));
}

RenderSettings settingsFor(const RenderSettings& base, const Measurement& m) {
  RenderSettings settings = base;
  settings.preintegrated = m.way == Way::pre;
  (m.way == Way::error ? settings.error : settings.step) = m.parameter;
  return settings;
}

void measure(const AccuracyScene& scene, const RenderSettings& base, const std::vector<double>& reference,
             Measurement& m) {
  RendererOptions options;
  options.method = Method::full;
  options.threads = 1;
  DifferentialRenderer renderer(scene.lattice, settingsFor(base, m), options);
  compare(renderer.start(scene.field), reference, m);
  ChangedVoxels none;
  none.values = makeVoxelArray(scene.lattice.type);
  for (int round = 0; round < kRounds; ++round) {
    const double from = cpuMilliseconds();
    renderer.update(none);
    m.milliseconds = std::min(m.milliseconds, cpuMilliseconds() - from);
    if (m.milliseconds > 2000) break;
  }
  m.samples = double(renderer.statistics().samples);
}

// A frame of a sequence, from as few rays as its error allows: the last of the scene's steps, everything but
// reading it charged.
void measureRays(const AccuracyScene& scene, const RenderSettings& settings, double goal,
                 const std::vector<double>& reference, Measurement& m) {
  ThreadPool pool(1);
  ChangeDetector detector(scene.before.front(), 0);
  std::vector<ChangedVoxels> steps;
  for (size_t s = 1; s < scene.before.size(); ++s) steps.push_back(detector.advance(scene.before[s], pool));
  steps.push_back(detector.advance(scene.field, pool));
  for (int round = 0; round < kRounds; ++round) {
    RendererOptions options;
    options.method = Method::anytime;
    options.threads = 1;
    options.budget = Budget::ofError(goal);
    const auto renderer = makeRenderer(scene.lattice, settings, options);
    renderer->start(scene.before.front());
    for (size_t s = 0; s + 1 < steps.size(); ++s) renderer->update(steps[s]);
    const double from = cpuMilliseconds();
    renderer->update(steps.back());
    m.milliseconds = std::min(m.milliseconds, cpuMilliseconds() - from);
    if (round > 0) continue;
    compare(renderer->image(), reference, m);
    m.samples = double(renderer->statistics().samples);
  }
}

// Of each way to sample a ray the longest sample distance whose own error leaves room for that of leaving
// rays out: what accuracy.md tells its readers to choose.
void sweepRays(const AccuracyScene& scene, const RenderSettings& base, const std::vector<double>& reference,
               std::vector<Measurement>& all) {
  constexpr double kOwnShare = 0.75;
  const std::vector<Measurement> fixed = all;
  for (const double error : kRayErrors)
    for (const Way way : {Way::post, Way::pre}) {
      const auto found = std::find_if(fixed.begin(), fixed.end(), [&](const Measurement& m) {
        return m.way == way && m.parameter <= 4 && m.rmse <= kOwnShare * error;
      });
      if (found == fixed.end()) continue;
      all.push_back({Way::rays, error});
      measureRays(scene, settingsFor(base, *found), std::sqrt(error * error - found->rmse * found->rmse),
                  reference, all.back());
    }
}

// Sample distances are halved until the error is below the smallest of interest.
std::vector<Measurement> sweep(const AccuracyScene& scene, const RenderSettings& base,
                               const std::vector<double>& reference) {
  std::vector<Measurement> all;
  for (const Way way : {Way::post, Way::pre})
    for (double step = 16; step >= 1.0 / 64; step /= 2) {
      all.push_back({way, step});
      measure(scene, base, reference, all.back());
      if (all.back().rmse < 9e-5) break;
    }
  for (const double error : kErrors) {
    all.push_back({Way::error, error});
    measure(scene, base, reference, all.back());
  }
  if (!scene.before.empty()) sweepRays(scene, base, reference, all);
  return all;
}

// What an image with that error costs: between two measurements along the straight line of their logarithms.
double timeAt(const std::vector<Measurement>& all, Way way, double rmse) {
  if (way == Way::rays) {  // two ways to sample a ray: the quicker one that is good enough
    double least = HUGE_VAL;
    for (const Measurement& m : all)
      if (m.way == way && m.rmse <= rmse) least = std::min(least, m.milliseconds);
    return least;
  }
  const Measurement* coarser = nullptr;
  for (const Measurement& m : all) {
    if (m.way != way) continue;
    if (m.rmse <= rmse) {
      if (coarser == nullptr) return m.milliseconds;
      const double f = std::log(coarser->rmse / rmse) / std::log(coarser->rmse / m.rmse);
      return std::exp(std::lerp(std::log(coarser->milliseconds), std::log(m.milliseconds), f));
    }
    coarser = &m;
  }
  return HUGE_VAL;
}

double lastTime(const std::vector<Measurement>& all, Way way) {
  double last = 0;
  for (const Measurement& m : all)
    if (m.way == way) last = m.milliseconds;
  return last;
}

std::string fileName(std::string title) {
  for (char& c : title)
    if (c == '/' || c == ' ') c = '-';
  return title;
}

void writePlot(const std::string& directory, const std::string& title, const std::vector<Measurement>& all) {
  plot::Chart chart;
  chart.title = title;
  chart.xLabel = "CPU time of a frame";
  chart.yLabel = "RMSE";
  chart.xUnit = " ms";
  double shortest = 1e30, longest = 0, smallest = 1e30, largest = 0;
  const char* const colours[] = {"#888", "#2a7ae2", "#d2491f", "#2a9d4a"};
  for (int w = 0; w < kWays; ++w) {
    plot::Series series{kWayNames[w], colours[w], {}, plot::Series::Line::straight, plot::Marker::circle, 1};
    for (const Measurement& m : all) {
      if (int(m.way) != w) continue;
      series.points.push_back({m.milliseconds, std::max(m.rmse, 1e-6)});
      shortest = std::min(shortest, m.milliseconds);
      longest = std::max(longest, m.milliseconds);
      smallest = std::min(smallest, std::max(m.rmse, 1e-6));
      largest = std::max(largest, m.rmse);
    }
    chart.series.push_back(series);
  }
  chart.x = plot::Scale::logarithmic(shortest, longest);
  chart.y = plot::Scale::logarithmic(smallest, largest);
  chart.nameEnds = true;
  chart.width = 640;
  std::string svg = plot::svg(chart);
  const std::string style = std::string(
                                "<style>svg{--text:#222;--muted:#777;--grid:#ddd;--page:#fff;background:"
                                "#fff;font:12px sans-serif}") +
                            plot::chartStyle() + "</style>";
  svg.insert(svg.find('>') + 1, style);
  if (svg.find("xmlns=") == std::string::npos)
    svg.insert(svg.find("<svg") + 4, " xmlns=\"http://www.w3.org/2000/svg\"");
  std::ofstream(directory + "/accuracy-" + fileName(title) + ".svg") << svg;
}

std::string ratioText(const std::vector<Measurement>& all, Way way, double rmse) {
  const double post = timeAt(all, Way::post, rmse), other = timeAt(all, way, rmse);
  char text[64];
  if (!std::isfinite(other)) return "not reached";
  if (std::isfinite(post))
    std::snprintf(text, sizeof text, "%.2f", post / other);
  else
    std::snprintf(text, sizeof text, "> %.2f", lastTime(all, Way::post) / other);
  return text;
}

// The largest true error of those that were to have an error E, in shares of it.
std::string largestShare(const std::vector<Measurement>& all, Way way, double error) {
  double largest = 0;
  for (const Measurement& m : all)
    if (m.way == way && m.parameter == error) largest = std::max(largest, m.rmse / error);
  char text[16];
  std::snprintf(text, sizeof text, "%.2f", largest);
  return largest > 0 ? text : "";
}

class Report {
 public:
  explicit Report(const std::string& directory)
      : directory_(directory), csv_(directory + "/accuracy.csv"), table_(directory + "/accuracy.md") {
    csv_ << "scene,transfer_function,way,parameter,rmse,largest,cpu_ms,samples\n";
    table_ << "| scene | pre-integrated, 1e-3 | 1e-4 | error-driven samples, 1e-3 | 1e-4 | true / E at 1e-2 "
              "| 1e-3 "
              "| 1e-4 | error-driven rays, 1e-3 | 1e-4 | true / E at 1e-2 | 1e-3 | 1e-4 |\n"
           << "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  }
  void add(const AccuracyScene& scene, const char* classification, const std::vector<Measurement>& all) {
    char row[256];
    for (const Measurement& m : all) {
      std::snprintf(row, sizeof row, "%s,%s,%s,%g,%.3e,%.3e,%.1f,%.0f\n", scene.name.c_str(), classification,
                    kWayNames[int(m.way)], m.parameter, m.rmse, m.largest, m.milliseconds, m.samples);
      csv_ << row << std::flush;
      std::fputs(row, stdout);
    }
    table_ << "| " << scene.name << " " << classification;
    for (const double rmse : {1e-3, 1e-4}) table_ << " | " << ratioText(all, Way::pre, rmse);
    for (const Way way : {Way::error, Way::rays}) {
      for (const double rmse : {1e-3, 1e-4}) table_ << " | " << ratioText(all, way, rmse);
      for (const double error : {1e-2, 1e-3, 1e-4}) table_ << " | " << largestShare(all, way, error);
    }
    table_ << " |\n" << std::flush;
    writePlot(directory_, scene.name + " " + classification, all);
  }

 private:
  std::string directory_;
  std::ofstream csv_, table_;
};

void run(const std::string& directory, const std::string& data, const std::string& filter) {
  std::filesystem::create_directories(directory);
  Report report(directory);
  ThreadPool pool(1);
  for (const AccuracyScene& scene : bench::accuracyScenes(data)) {
    if (scene.name.find(filter) == std::string::npos) continue;
    const BrickVolume volume(scene.lattice, scene.field, pool);
    for (const Classification classification : {Classification::soft, Classification::band}) {
      const RenderSettings base = scene.settings(classification);
      const auto reference = referencePixels(base, volume);
      report.add(scene, classification == Classification::soft ? "soft" : "band",
                 sweep(scene, base, reference));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("accuracy_bench OUT [DATA] [FILTER]\n", stderr);
    return 2;
  }
  try {
    run(argv[1], argc > 2 ? argv[2] : "", argc > 3 ? argv[3] : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "accuracy_bench: %s\n", error.what());
    return 1;
  }
}
