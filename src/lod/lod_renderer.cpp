#include "lod/lod_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "core/error.h"

namespace kairos {
namespace {

constexpr float kNoSample = -std::numeric_limits<float>::max();

LodSettings checked(LodSettings settings, const Lattice& lattice, const GlContext& context) {
  context.makeCurrent();  // what the renderer's members create belongs to it
  settings.subdivision.bytesPerTexel = bytesPerTexel(SubvolumeTextures::formatFor(lattice.type));
  settings.validate();
  if (std::max(settings.width, settings.height) > context.maxImageEdge())
    throw OptionError("--size", "found " + std::to_string(settings.width) + "x" +
                                    std::to_string(settings.height) + ", but this OpenGL draws up to " +
                                    std::to_string(context.maxImageEdge()) + " pixels along an edge");
  return settings;
}

PointBox sampledCells(const LodVolume& volume) {
  const PointBox box = volume.lattice().samplingBox();
  const Vec3d origin(volume.pyramid().origin());
  return {box.lo - origin, box.hi - origin};
}

ClassificationTable unitTable(const LodSettings& settings) {
  return ClassificationTable(settings.transferFunction, settings.range, 1.0);
}

}  // namespace

LodRenderer::LodRenderer(const GlContext& context, const Lattice& lattice, const Field& field,
                         const LodSettings& settings, ThreadPool& pool, const LodHierarchy* stored)
    : context_(context),
      settings_(checked(settings, lattice, context)),
      volume_(lattice, field, settings_.subdivision, pool, stored),
      sampled_(sampledCells(volume_)),
      unitTable_(unitTable(settings_)),
      textures_(volume_, settings_.textureMemory),
      framebuffer_(settings_.width, settings_.height),
      maxOpacity_(volume_.subdivision().size()),
      levels_(volume_.subdivision().size(), 0),
      signatures_(volume_.subdivision().size(), 0) {
  for (const Subvolume& s : volume_.subdivision().subvolumes()) {
    const Vec3i n = s.vertices(0);
    const uint64_t bytes =
        uint64_t(n.x) * uint64_t(n.y) * uint64_t(n.z) * uint64_t(settings_.subdivision.bytesPerTexel);
    if (bytes > settings_.textureMemory)
      throw OptionError("--texture-memory", "found " + std::to_string(settings_.textureMemory) +
                                                " bytes, expected at least the " + std::to_string(bytes) +
                                                " of the largest subvolume");
    if (std::max({n.x, n.y, n.z}) > context.maxTextureEdge())
      throw OptionError("subdivision", "a subvolume of " + std::to_string(s.edge) +
                                           " voxels is longer than this OpenGL's textures");
  }
  std::vector<uint32_t> all(volume_.subdivision().size());
  std::iota(all.begin(), all.end(), 0u);
  measureOpacities(all);
}

// Opacities of every voxel, not of the value range: a transfer function may be opaque in between.
void LodRenderer::measureOpacities(const std::vector<uint32_t>& subvolumes) {
  const ScalarPyramid& pyramid = volume_.pyramid();
  for (const uint32_t i : subvolumes) {
    const VoxelBox& box = volume_.subdivision().subvolumes()[i].cells;
    const ValueRange range = volume_.range(i);
    float highest = 0;
    if (unitTable_.visible(range.lo, range.hi))
      for (int z = box.lo.z; z <= box.hi.z; ++z)
        for (int y = box.lo.y; y <= box.hi.y; ++y)
          for (int x = box.lo.x; x <= box.hi.x; ++x)
            highest = std::max(highest, unitTable_.classify<float>(pyramid.value(0, {x, y, z}))[3]);
    // Between two voxels that cannot be seen something may be.
    maxOpacity_[i] = unitTable_.visible(range.lo, range.hi)
                         ? std::max(double(highest), std::numeric_limits<double>::min())
                         : 0;
  }
}

void LodRenderer::apply(const ChangedVoxels& changes) {
  textures_.markStale(volume_.apply(changes));
  measureOpacities(volume_.dirtySubvolumes());
}

SliceProgram& LodRenderer::program(bool parallel) {
  std::optional<SliceProgram>& program = parallel ? parallel_ : perspective_;
  if (!program) program.emplace(settings_, volume_.lattice(), parallel, textures_.valueScale());
  return *program;
}

void LodRenderer::findVisible(const SliceView& view) {
  volume_.subdivision().frontToBack(view.orderingEye(), view.parallel(), order_);
  if (settings_.order == BlendOrder::backToFront) std::reverse(order_.begin(), order_.end());
  visible_.clear();
  for (const uint32_t i : order_) {
    const bool seen = settings_.mode == LodMode::mip || maxOpacity_[i] > 0;
    if (seen) {
      const SliceView::Box box = view.box(volume_.subdivision().subvolumes()[i].cells);
      const SliceView::Extent extent = view.extent(box);
      if (extent.volume > 0) {
        visible_.push_back({i, box, extent});
        continue;
      }
    }
    levels_[i] = 0;
    ++statistics_.skipped;
  }
}

void LodRenderer::weigh(const Importance& importance) {
  views_.clear();
  for (const Visible& v : visible_)
    views_.push_back(
        {maxOpacity_[v.subvolume], v.extent.distance, v.extent.area, v.extent.centreX, v.extent.centreY});
  importances_.assign(views_.size(), 0);
  importance(views_, importances_);
  for (const double i : importances_)
    if (!(i >= 0) || !std::isfinite(i))
      throw OptionError("importance", "found " + std::to_string(i) + ", expected a number of 0 or more");
  importanceSum_ = std::accumulate(importances_.begin(), importances_.end(), 0.0);
}

const LodTask& LodRenderer::taskOf(const Visible& visible, double importance) {
  const Subvolume& s = volume_.subdivision().subvolumes()[visible.subvolume];
  task_.subvolume = visible.subvolume;
  task_.importance = importance;
  task_.work.clear();
  task_.deviations.clear();
  const double finest = settings_.worldStep(volume_.lattice());
  const uint8_t before = levels_[visible.subvolume];
  for (int lod = 0; lod < settings_.lodCount(s.levels); ++lod) {
    const int level = settings_.levelOf(lod);
    const double spacing = finest * settings_.spacing(lod);
    const Vec3i n = s.vertices(level);
    levels_[visible.subvolume] = uint8_t(level);
    task_.work.push_back({visible.extent.depth / spacing, visible.extent.volume / spacing,
                          double(n.x) * n.y * n.z, textures_.resident(levels_, visible.subvolume)});
    task_.deviations.push_back(volume_.deviation(visible.subvolume, level));
  }
  levels_[visible.subvolume] = before;
  return task_;
}

void LodRenderer::renderSubvolume(const SliceView& view, const Visible& visible, double importance,
                                  double began, LodController& controller, Clock& clock) {
  const uint32_t i = visible.subvolume;
  const double start = clock.seconds();
  const LodTask& task = taskOf(visible, importance);
  const int lod = controller.choose(task, start - began);
  levels_[i] = uint8_t(settings_.levelOf(lod));
  const double chosen = clock.seconds();

  SubvolumeRecord record{
      i,  lod, int(levels_[i]), importanceSum_ > 0 ? importance / importanceSum_ : 0, controller.lastShare(),
      {}, {}};
  record.timing.work = task.work[size_t(lod)];
  const uint64_t loaded = textures_.bind(levels_, i);
  signatures_[i] = boundarySignature(volume_.subdivision(), levels_, i);
  if (loaded) glFinish();
  const double bound = clock.seconds();
  view.slice(visible.box, settings_.worldStep(volume_.lattice()) * settings_.spacing(lod), polygons_);
  program(view.parallel()).draw(view, volume_.subdivision().subvolumes()[i], sampled_, lod, polygons_);
  const double submitted = clock.seconds();
  glFinish();
  const double finished = clock.seconds();

  record.timing.loadSeconds = bound - chosen;
  record.timing.geometrySeconds = submitted - bound;
  record.timing.rasterizeSeconds = finished - submitted;
  controller.rendered(task, lod, record.timing);
  statistics_.loadSeconds += record.timing.loadSeconds;
  statistics_.geometrySeconds += record.timing.geometrySeconds;
  statistics_.rasterizeSeconds += record.timing.rasterizeSeconds;
  statistics_.slices += uint64_t(polygons_.slices());
  statistics_.fragments += polygons_.pixels;
  statistics_.texturesKept += loaded == 0;
  statistics_.records.push_back(record);
  statistics_.controlSeconds += (chosen - start) + (clock.seconds() - finished);
}

const Image& LodRenderer::render(const Camera& camera, LodController& controller,
                                 const Importance& importance, double budgetSeconds, Clock& clock) {
  const double began = clock.seconds();
  context_.makeCurrent();
  std::vector<SubvolumeRecord> records = std::move(statistics_.records);
  records.clear();
  statistics_ = {};
  statistics_.records = std::move(records);
  statistics_.budgetSeconds = budgetSeconds;
  const TexturePoolCounters before = textures_.counters();
  const SliceView view(camera, settings_, volume_.lattice(), volume_.pyramid().origin(),
                       volume_.pyramid().cells());
  program(view.parallel()).begin(view);
  framebuffer_.begin(settings_.mode == LodMode::mip ? kNoSample : 0);
  const double prepared = clock.seconds();
  findVisible(view);
  weigh(importance);
  LodFramePlan plan;
  // Reading the image back is part of the frame; it takes what it took last time.
  plan.budget = budgetSeconds > 0 ? std::max(1e-9, budgetSeconds - readSeconds_) : 0;
  for (const Visible& v : visible_) plan.subvolumes.push_back(v.subvolume);
  plan.importances = importances_;
  statistics_.records.reserve(visible_.size());
  controller.beginFrame(plan);
  statistics_.controlSeconds += clock.seconds() - prepared;

  for (size_t n = 0; n < visible_.size(); ++n)
    renderSubvolume(view, visible_[n], importances_[n], began, controller, clock);
  for (size_t n = 0; n < statistics_.records.size(); ++n) statistics_.records[n].view = views_[n];
  const double drawn = clock.seconds();
  controller.endFrame(drawn - began);
  image_ = framebuffer_.read();
  finishImage();
  statistics_.subvolumes = visible_.size();
  statistics_.infeasible = controller.infeasible();
  statistics_.texturesLoaded = textures_.counters().uploads - before.uploads;
  statistics_.bytesLoaded = textures_.counters().bytesUploaded - before.bytesUploaded;
  countOpenBoundaries();
  const double end = clock.seconds();
  statistics_.readSeconds = readSeconds_ = end - drawn;
  statistics_.totalSeconds = end - began;
  return image_;
}

// A projection is classified once its largest sample is known.
void LodRenderer::finishImage() {
  if (settings_.mode != LodMode::mip) return;
  for (size_t p = 0; p < image_.data.size(); p += 4) {
    const float value = image_.data[p];
    const std::array<float, 4> colour =
        value == kNoSample ? std::array<float, 4>{} : unitTable_.classify<float>(value);
    std::copy(colour.begin(), colour.end(), image_.data.begin() + int64_t(p));
  }
}

void LodRenderer::countOpenBoundaries() {
  for (const Visible& v : visible_)
    statistics_.openBoundaries +=
        boundarySignature(volume_.subdivision(), levels_, v.subvolume) != signatures_[v.subvolume];
}

namespace {

// Everything at its coarsest.
class CoarsestController : public LodController {
 public:
  void beginFrame(const LodFramePlan&) override {}
  int choose(const LodTask& task, double) override { return int(task.work.size()) - 1; }
  void rendered(const LodTask&, int, const LodTiming&) override {}
  void endFrame(double) override {}
};

}  // namespace

// Loads textures, the coarsest first, while there is room, each with its neighbours so many levels coarser.
// Returns the seconds a voxel.
double LodRenderer::loadTextures(int coarser, Clock& clock) {
  const auto& subvolumes = volume_.subdivision().subvolumes();
  double seconds = 0;
  uint64_t voxels = 0;
  const uint64_t evicted = textures_.counters().evicted;
  for (int level = volume_.pyramid().levels() - 1; level >= 0; --level)
    for (uint32_t i = 0; i < subvolumes.size() && textures_.counters().evicted == evicted; ++i) {
      if (level >= subvolumes[i].levels || maxOpacity_[i] == 0) continue;
      for (uint32_t j = 0; j < subvolumes.size(); ++j)
        levels_[j] = uint8_t(std::min(level + coarser, subvolumes[j].levels - 1));
      levels_[i] = uint8_t(level);
      const double begin = clock.seconds();
      voxels += textures_.bind(levels_, i);
      glFinish();
      seconds += clock.seconds() - begin;
    }
  std::fill(levels_.begin(), levels_.end(), uint8_t(0));
  return voxels ? seconds / double(voxels) : 0;
}

LodProfile LodRenderer::profile(const Camera& camera, Clock& clock) {
  CoarsestController coarsest;
  render(camera, coarsest, uniformImportance(), 0, clock);  // the driver compiles its shaders
  render(camera, coarsest, uniformImportance(), 0, clock);
  std::vector<LodTiming> timings;
  for (const SubvolumeRecord& record : statistics_.records) timings.push_back(record.timing);
  LodProfile profile{0, fitFragmentModel(timings).perFragment, fitSliceModel(timings).perSlice};

  // A texture's memory is new once; what counts is loading it again, for coarser neighbours.
  loadTextures(0, clock);
  profile.secondsPerVoxel = loadTextures(1, clock);
  loadTextures(0, clock);
  return profile;
}

}  // namespace kairos
