#include "diff/frame_renderer.h"

#include <algorithm>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/stopwatch.h"

namespace kairos {

const char* name(Method method) {
  static constexpr const char* kNames[] = {"full",    "segments", "dvrm",  "tldvrm",
                                           "anytime", "tcdvrm",   "tiles", "lowres"};
  return kNames[int(method)];
}

bool budgeted(Method method) {
  return method >= Method::anytime;
}

bool takes(Method method, const Budget& budget) {
  return budget.error > 0 ? method == Method::anytime : budgeted(method);
}

FrameRenderer::FrameRenderer(const Lattice& lattice, const RenderSettings& settings,
                             const RendererOptions& options)
    : options_(options), pool_(options.threads), scene_(lattice, settings, pool_) {
  if (options.tilesPerTask < 1) throw OptionError("tilesPerTask", "expected at least 1");
  image_ = Image(settings.width, settings.height, 4);
  if (!settings.depth) return;
  depth_ = Image(settings.width, settings.height, 1);
  std::fill(depth_.data.begin(), depth_.data.end(), std::numeric_limits<float>::infinity());
}

FrameRenderer::~FrameRenderer() = default;

const Image& FrameRenderer::start(const Field& field) {
  takeWhole(field);
  detector_.reset();
  return image_;
}

const Image& FrameRenderer::update(const ChangedVoxels& changes) {
  takeChanges(changes);
  detector_.reset();
  return image_;
}

void FrameRenderer::takeWhole(const Field& field) {
  beginFrame();
  Stopwatch clock;
  scene_.start(field);
  statistics_ = {};
  statistics_.updateMs = clock.lap();
  renderWhole();
  countBricks();
}

void FrameRenderer::takeChanges(const ChangedVoxels& changes) {
  beginFrame();
  Stopwatch clock;
  beforeUpdate(changes);
  const AppliedChanges applied = scene_.apply(changes);
  statistics_ = {};
  statistics_.voxelsChanged = statistics_.voxelsSampled = changes.count();
  statistics_.updateMs = clock.lap();
  renderChanges(changes, applied);
  countBricks();
}

void FrameRenderer::countBricks() {
  statistics_.bricksVisible = scene_.occupancy().visibleCount();
  statistics_.bricksSkipped = scene_.volume().cellCount() - scene_.occupancy().visibleCount();
}

const char* FrameRenderer::name(Aov kind) {
  static constexpr const char* kNames[] = {"error", "age", "level", "influence", "samples"};
  return kNames[int(kind)];
}

Image FrameRenderer::aov(Aov kind) const {
  Image values(image_.width, image_.height, 1);
  std::fill(values.data.begin(), values.data.end(), kind == Aov::level ? 1.0f : 0.0f);
  return values;
}

template <class T>
const Image& FrameRenderer::render(const T* values, double tolerance) {
  const Lattice& lattice = scene_.lattice();
  if (elementTypeOf<T>() != lattice.type)
    throw StateError("the array holds " + std::string(kairos::name(elementTypeOf<T>())) +
                     " values, the lattice says " + std::string(kairos::name(lattice.type)));
  Field field = fieldFromDense(values, lattice.domain.size(), T(lattice.background), lattice.domain.lo);
  if (!detector_ || tolerance != detectorTolerance_) {
    auto detector = std::make_unique<ChangeDetector>(field, tolerance);
    takeWhole(field);
    detector_ = std::move(detector);
    detectorTolerance_ = tolerance;
  } else {
    takeChanges(detector_->advance(std::move(field), pool_));
  }
  return image_;
}
template const Image& FrameRenderer::render(const uint8_t*, double);
template const Image& FrameRenderer::render(const uint16_t*, double);
template const Image& FrameRenderer::render(const float*, double);

}  // namespace kairos
