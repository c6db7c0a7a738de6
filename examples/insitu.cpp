// A running simulation that draws itself: a Gray-Scott reaction-diffusion solver hands the array of each step
// to a DifferentialRenderer and gets its frame back. No file is involved, and what has settled, or what the
// reaction has not reached yet, costs nothing.
//
//     insitu [LAST_FRAME.ppm]
//
// Every few steps a renderer that casts every ray follows, to show that the frames are the same bits and what
// the difference in work is. A third renderer has a deadline for every frame, and tells how wrong its frames
// may be. The exit code says whether the bits were the same and the work less.
#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image_difference.h"
#include "core/srgb.h"
#include "diff/differential_renderer.h"
#include "tcdvrm/renderer_factory.h"

using namespace kairos;

namespace {

constexpr int kEdge = 96;
constexpr int kSteps = 40, kIterationsPerStep = 20, kStepsPerCheck = 4;

/// Two substances that diffuse and react, U + 2V -> 3V, on a box whose walls hold fresh U. Drawn is V.
class GrayScott {
 public:
  explicit GrayScott(ThreadPool& pool)
      : pool_(pool), u_(kVoxels, 1.0f), v_(kVoxels, 0.0f), nextU_(u_), nextV_(v_) {}

  /// Stirs a drop of V in.
  void addDrop(const Vec3d& at, double radius) {
    const auto low = [&](double c) { return int(std::ceil(c - radius)); };
    for (int z = low(at.z); z <= at.z + radius; ++z)
      for (int y = low(at.y); y <= at.y + radius; ++y)
        for (int x = low(at.x); x <= at.x + radius; ++x) {
          if (length(Vec3d(Vec3i{x, y, z}) - at) > radius) continue;
          const size_t i = size_t(z) * kPlane + size_t(y) * kRow + size_t(x);
          u_[i] = 0.5f;
          v_[i] = 0.3f;
        }
  }

  void advance(int iterations) {
    for (int i = 0; i < iterations; ++i) {
      pool_.forEach(kEdge - 2, 8, [&](size_t begin, size_t end) {
        for (size_t z = begin + 1; z <= end; ++z) reactInPlane(z);
      });
      std::swap(u_, nextU_);
      std::swap(v_, nextV_);
    }
  }

  /// kEdge^3 values, x fastest.
  const float* concentration() const { return v_.data(); }

 private:
  static constexpr size_t kRow = kEdge, kPlane = kRow * kRow, kVoxels = kPlane * kEdge;
  static constexpr float kDiffusionU = 0.16f, kDiffusionV = 0.08f, kFeed = 0.046f, kKill = 0.065f;

  static float laplacian(const float* f) {
    return f[-1] + f[1] + f[-int(kRow)] + f[kRow] + f[-int(kPlane)] + f[kPlane] - 6 * f[0];
  }

  void reactInPlane(size_t z) {
    for (size_t y = 1; y + 1 < kRow; ++y) {
      const size_t row = z * kPlane + y * kRow;
      const float *u = u_.data() + row, *v = v_.data() + row;
      float *nextU = nextU_.data() + row, *nextV = nextV_.data() + row;
      for (size_t x = 1; x + 1 < kRow; ++x) {
        const float reaction = u[x] * v[x] * v[x];
        nextU[x] = u[x] + kDiffusionU * laplacian(u + x) - reaction + kFeed * (1 - u[x]);
        nextV[x] = v[x] + kDiffusionV * laplacian(v + x) + reaction - (kFeed + kKill) * v[x];
      }
    }
  }

  ThreadPool& pool_;
  std::vector<float> u_, v_, nextU_, nextV_;
};

/// What stirs the reaction: a few drops to begin with, then a pen that draws a trefoil knot within 30 steps.
void stir(GrayScott& simulation, int step) {
  constexpr int kPenSteps = 30, kPenDropsPerStep = 4;
  const Vec3d centre = Vec3d{1, 1, 1} * ((kEdge - 1) / 2.0);
  if (step == 0)
    for (const Vec3d& at : {Vec3d{-30, -30, 25}, {34, 22, -30}, {-28, 34, -24}, {30, -34, -14}})
      simulation.addDrop(centre + at, 5);
  for (int i = 0; i < kPenDropsPerStep && step < kPenSteps; ++i) {
    const double t = 2 * std::numbers::pi * (step + i / double(kPenDropsPerStep)) / kPenSteps;
    const Vec3d knot{std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t),
                     -1.4 * std::sin(3 * t)};
    simulation.addDrop(centre + knot * 12.0, 3.5);
  }
}

constexpr float kHighest = 0.4f;  // of V, about
constexpr double kDeadlineMs = 4;
constexpr double kTolerance = kHighest / 255;  // what an 8-bit copy of the field could not tell apart

Lattice simulationLattice() {
  Lattice lattice;
  lattice.type = ElementType::f32;
  lattice.domain = {{0, 0, 0}, {kEdge, kEdge, kEdge}};
  lattice.dense = true;  // the field ends at the outermost voxels
  return lattice;
}

RenderSettings simulationView(const Lattice& lattice) {
  RenderSettings settings;
  settings.width = settings.height = 320;
  settings.camera = fittedCamera("iso", lattice.worldBounds(), 30, 1);
  settings.camera.verticalFovDegrees = 28;
  settings.range = {0, kHighest};
  // Fresh U is a faint blue haze, so that the regions the reaction has not reached are in the picture too.
  settings.transferFunction = {
      {{0.00, {0.05, 0.20, 0.60}},
       {0.10, {0.04, 0.10, 0.60}},
       {0.19, {0.05, 0.55, 0.65}},
       {0.26, {0.95, 0.42, 0.08}},
       {0.32, {1.00, 0.75, 0.30}},
       {0.40, {1.00, 0.95, 0.80}}},
      {{0.00, 0.001}, {0.05, 0.001}, {0.14, 0.04}, {0.20, 0.10}, {0.26, 0.45}, {0.40, 0.9}}};
  settings.shade = true;
  return settings;
}

RendererOptions withMethod(Method method, Budget budget = {}) {
  RendererOptions options;
  options.method = method;
  options.budget = budget;
  return options;
}

/// The yardstick: follows the same reconstruction, and casts every ray of it when asked to.
class FullRender {
 public:
  FullRender(const Lattice& lattice, const RenderSettings& settings)
      : lattice_(lattice), renderer_(lattice, settings, withMethod(Method::full)) {}

  void follow(const float* values, ThreadPool& pool) {
    Field field = fieldFromDense(values, lattice_.domain.size());
    if (detector_)
      detector_->advance(std::move(field), pool);
    else
      detector_.emplace(std::move(field), kTolerance);
  }
  const DifferentialRenderer& cast() {
    renderer_.start(detector_->reconstruction());
    return renderer_;
  }

 private:
  Lattice lattice_;
  DifferentialRenderer renderer_;
  std::optional<ChangeDetector> detector_;
};

bool sameBits(const Image& a, const Image& b) {
  return a.data.size() == b.data.size() &&
         std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(float)) == 0;
}

void writePpm(const std::string& path, const Image& image) {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << image.width << ' ' << image.height << "\n255\n";
  for (size_t i = 0; i < image.data.size(); ++i)
    if (i % 4 != 3) file.put(char(std::lround(255 * srgbFromLinear(displayed(image.data[i])))));
  if (!file.flush()) throw OutputError(path, "could not be written");
}

double milliseconds() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

struct Tally {
  bool same = true;
  double worst = 0;  // RMSE of the frames with a deadline
  uint64_t samples = 0, samplesOfFull = 0;
  double share() const { return double(samples) / double(samplesOfFull); }
};

void compare(const DifferentialRenderer& renderer, const DifferentialRenderer& full, int step, Tally& tally) {
  const uint64_t samples = renderer.statistics().samples, samplesOfFull = full.statistics().samples;
  tally.same = tally.same && sameBits(renderer.image(), full.image());
  if (step > 0) {
    tally.samples += samples;
    tally.samplesOfFull += samplesOfFull;
  }
  std::printf("  %5.1f %%", 100 * double(samples) / double(samplesOfFull));
}

void printFrame(int step, const FrameStatistics& s, double ms) {
  std::printf("\n%4d %14" PRIu64 " %13" PRIu64 " of %" PRIu64 " %12" PRIu64 " %8.1f", step, s.voxelsChanged,
              s.segmentsRecast, s.segmentsTotal, s.samples, ms);
}

/// Runs the simulation; true when the frames were the full render's and the work well below it.
bool run(const std::string& lastFrame) {
  ThreadPool pool;
  GrayScott simulation(pool);
  const Lattice lattice = simulationLattice();
  const RenderSettings settings = simulationView(lattice);
  DifferentialRenderer renderer(lattice, settings, {});
  FullRender full(lattice, settings);
  const std::unique_ptr<FrameRenderer> onTime =
      makeRenderer(lattice, settings, withMethod(Method::anytime, Budget::time(kDeadlineMs)));

  Tally tally;
  std::printf(
      "step voxels changed  segments integrated      samples       ms  "
      "error with a deadline of %.0f ms  of a full frame's samples",
      kDeadlineMs);
  for (int step = 0; step <= kSteps; ++step) {
    stir(simulation, step);
    simulation.advance(kIterationsPerStep);

    const double begin = milliseconds();
    renderer.render(simulation.concentration(), kTolerance);  // all that a simulation has to call
    printFrame(step, renderer.statistics(), milliseconds() - begin);

    onTime->render(simulation.concentration(), kTolerance);
    if (const auto& error = onTime->statistics().error) std::printf("  %.4f", error->rmse);
    tally.worst = std::max(tally.worst, colourError(onTime->image(), renderer.image()).rmse);

    full.follow(simulation.concentration(), pool);
    if (step % kStepsPerCheck == 0) compare(renderer, full.cast(), step, tally);
  }
  std::printf(
      "\nframes equal the full render's: %s; samples after the first frame: %.1f %% of the full render's\n",
      tally.same ? "yes, bit for bit" : "NO", 100 * tally.share());
  std::printf("with a deadline of %.0f ms no frame was off by more than %.4f (RMSE)\n", kDeadlineMs,
              tally.worst);
  if (!lastFrame.empty()) writePpm(lastFrame, renderer.image());
  return tally.same && tally.share() < 0.5;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? argv[1] : "") ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "insitu: %s\n", e.what());
    return 2;
  }
}
