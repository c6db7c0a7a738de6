#include "app/step_source.h"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "app/text_format.h"
#include "core/error.h"
#include "diff/change_detection.h"
#include "io/file_bytes.h"
#include "io/sequence.h"

namespace kairos {
namespace {

uint64_t hashOf(const std::string& text) {
  return xxh64(text);
}

// Differential files and key frames of the static phase.
class SequenceSource : public StepSource {
 public:
  explicit SequenceSource(const std::string& directory) : reader_(directory) {
    lattice_ = reader_.manifest().lattice;
    for (const SequenceStep& step : reader_.manifest().steps) steps_.push_back(step.step);
  }

  std::string name() const override { return reader_.directory(); }
  std::string stepName(size_t index) const override {
    return reader_.manifest().steps[index].differential ? reader_.differentialPath(index)
                                                        : reader_.keyPath(index);
  }

  ValueRange valueRange(const ProgressCallback&, const StopFlag&) override {
    return reader_.manifest().range();
  }

  uint64_t identity(size_t, size_t index) const override {
    return reader_.manifest().steps[index].stateChecksum;
  }
  bool seekable() const override { return true; }

  LoadedStep start(size_t index) override {
    last_ = index;
    return {index, reader_.readStep(index), 0, bytesOfChain(index),
            reader_.manifest().steps[index].nonFinite};
  }

  LoadedStep next() override {
    ++last_;
    return {last_, reader_.readChanges(last_), 0, reader_.bytes(last_),
            reader_.manifest().steps[last_].nonFinite};
  }

 private:
  // What readStep reads: the nearest key frame and the differential files from there.
  uint64_t bytesOfChain(size_t index) const {
    size_t key = index;
    while (key > 0 && !reader_.manifest().steps[key].key) --key;
    uint64_t bytes = std::filesystem::file_size(reader_.keyPath(key));
    for (size_t i = key + 1; i <= index; ++i) bytes += reader_.bytes(i);
    return bytes;
  }

  SequenceReader reader_;
  size_t last_ = 0;
};

// A simulation's own files.
class SeriesSource : public StepSource {
 public:
  SeriesSource(std::unique_ptr<InputSeries> series, std::string name, double tolerance, ThreadPool& pool)
      : series_(std::move(series)), name_(std::move(name)), tolerance_(tolerance), pool_(pool) {
    lattice_ = series_->lattice();
    for (const StepFile& file : series_->steps()) steps_.push_back(file.step);
  }

  std::string name() const override { return name_; }
  std::string stepName(size_t index) const override { return series_->steps()[index].path; }

  ValueRange valueRange(const ProgressCallback& progress, const StopFlag& stop) override {
    double lo = std::numeric_limits<double>::infinity(), hi = -lo;
    for (size_t i = 0; i < steps_.size(); ++i) {
      stop.check();
      const FieldStatistics statistics = fieldStatistics(series_->read(i));
      lo = std::min(lo, statistics.lo);
      hi = std::max(hi, statistics.hi);
      progress(int64_t(i + 1), int64_t(steps_.size()));
    }
    return lo <= hi ? ValueRange{float(lo), float(hi)} : ValueRange{0, 0};
  }

  // With a tolerance the reconstruction of a step depends on all steps before it.
  uint64_t identity(size_t first, size_t index) const override {
    const std::string settings = std::to_string(std::bit_cast<uint64_t>(tolerance_));
    if (seekable()) return hashOf(settings + fileEntry(index));
    if (chainBegin_ != first) chain_.clear();
    chainBegin_ = first;
    while (chain_.size() <= index - first)
      chain_.push_back(
          hashOf((chain_.empty() ? settings : hexOf(chain_.back())) + fileEntry(first + chain_.size())));
    return chain_[index - first];
  }
  bool seekable() const override { return tolerance_ == 0; }

  LoadedStep start(size_t index) override {
    last_ = index;
    Field field = series_->read(index);
    LoadedStep step{index, Field{}, 0, series_->bytes(index), nonFiniteOf(field)};
    detector_.emplace(field, tolerance_, ChangeDetector::States::unnamed);
    step.content = std::move(field);
    return step;
  }

  LoadedStep next() override {
    ++last_;
    Field field = series_->read(last_);
    LoadedStep step{last_, ChangedVoxels{}, 0, series_->bytes(last_), nonFiniteOf(field)};
    step.content = detector_->advance(std::move(field), pool_);
    return step;
  }

 private:
  // What tells one version of a file from another.
  std::string fileEntry(size_t index) const {
    const std::filesystem::path path = series_->steps()[index].path;
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(path, error);
    if (error) throw InputError(path.string(), "cannot be read: " + error.message());
    const auto written = std::filesystem::last_write_time(path, error);
    if (error) throw InputError(path.string(), "cannot be read: " + error.message());
    return '\n' + path.filename().string() + ' ' + std::to_string(bytes) + ' ' +
           std::to_string(written.time_since_epoch().count());
  }

  static int64_t nonFiniteOf(const Field& field) {
    return field.type() == ElementType::f32 ? fieldStatistics(field).nonFinite : 0;
  }

  std::unique_ptr<InputSeries> series_;
  std::string name_;
  double tolerance_;
  ThreadPool& pool_;
  std::optional<ChangeDetector> detector_;
  size_t last_ = 0;
  // Identities of the steps from `chainBegin_` on, as far as they were asked for.
  mutable size_t chainBegin_ = 0;
  mutable std::vector<uint64_t> chain_;
};

}  // namespace

SelectedSteps selectSteps(const StepSource& source, const StepRange& range, const std::string& option,
                          const std::string& text) {
  const auto& steps = source.steps();
  const auto first = std::find_if(steps.begin(), steps.end(), [&](int64_t s) { return range.contains(s); });
  if (first == steps.end())
    refuseValue(option, text,
                "time steps of " + source.name() + ", which has " + countText(steps.size(), "step") +
                    " from " + std::to_string(steps.front()) + " to " + std::to_string(steps.back()));
  SelectedSteps selected{size_t(first - steps.begin()), size_t(first - steps.begin())};
  while (selected.last + 1 < steps.size() && range.contains(steps[selected.last + 1])) ++selected.last;
  return selected;
}

std::unique_ptr<StepSource> openStepSource(const InputArguments& input, double tolerance, ThreadPool& pool) {
  std::unique_ptr<StepSource> source;
  if (input.isSequence()) {
    if (tolerance > 0)
      throw OptionError("--tolerance", "is for a simulation's files; " + input.inputs().front() +
                                           " is a sequence, whose changes were found by kairos diff");
    source = std::make_unique<SequenceSource>(input.sequenceDirectory());
  } else {
    source = std::make_unique<SeriesSource>(input.open(), input.inputs().front(), tolerance, pool);
  }
  if (source->steps().empty()) throw InputError(source->name(), "holds no time step, expected at least one");
  if (source->lattice().domain.empty())
    throw InputError(source->name(),
                     "no time step holds anything but the background, so there is nothing to render");
  return source;
}

}  // namespace kairos
