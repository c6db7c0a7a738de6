#include "app/static_phase.h"

#include <atomic>
#include <bit>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "core/bounded_queue.h"
#include "core/error.h"
#include "diff/change_detection.h"

namespace kairos {

namespace {

/// A step on its way from the files to the comparison, or the reason why it did not arrive.
struct LoadedStep {
  Field field;
  FieldStatistics statistics{};
  uint64_t activeVoxels = 0;
  std::exception_ptr failure;
};

/// A step on its way from the comparison to the files.
struct ComparedStep {
  SequenceStep entry;
  std::unique_ptr<Field> key;
  std::unique_ptr<ChangedVoxels> changes;
};

template <class T>
bool sameBits(T a, T b) {
  if constexpr (std::is_same_v<T, float>)
    return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b);
  else
    return a == b;
}

uint64_t countActiveVoxels(const Field& field) {
  return dispatch(field.type(), [&]<class T>() {
    const T background = T(field.background);
    uint64_t count = 0;
    for (T value : valuesAs<T>(field.values)) count += !sameBits(value, background);
    return count;
  });
}

/// Reads steps ahead of the comparison. Reader r of R takes steps first + r, first + r + R, ... into a queue
/// of its own, so that they arrive in order and at most 2 R fields are held.
class Reading {
 public:
  Reading(const InputSeries& input, size_t first, int readers) : input_(input), first_(first) {
    for (int r = 0; r < readers; ++r) queues_.push_back(std::make_unique<BoundedQueue<LoadedStep>>(1));
    for (size_t r = 0; r < queues_.size(); ++r) threads_.emplace_back([this, r] { readEvery(r); });
  }
  ~Reading() {
    for (auto& queue : queues_) queue->close();
    for (std::thread& thread : threads_) thread.join();
  }

  /// Steps must be taken in order. Throws what reading it threw.
  LoadedStep take(size_t index) {
    std::optional<LoadedStep> step = queues_[(index - first_) % queues_.size()]->pop();
    if (step->failure) std::rethrow_exception(step->failure);
    return std::move(*step);
  }

 private:
  void readEvery(size_t reader) {
    for (size_t i = first_ + reader; i < input_.steps().size(); i += queues_.size()) {
      LoadedStep step = load(i);
      const bool failed = step.failure != nullptr;
      if (!queues_[reader]->push(std::move(step)) || failed) return;
    }
  }

  LoadedStep load(size_t index) const noexcept {
    LoadedStep step;
    try {
      step.field = input_.read(index);
      step.statistics = fieldStatistics(step.field);
      step.activeVoxels = countActiveVoxels(step.field);
    } catch (...) {
      step.failure = std::current_exception();
    }
    return step;
  }

  const InputSeries& input_;
  const size_t first_;
  std::vector<std::unique_ptr<BoundedQueue<LoadedStep>>> queues_;
  std::vector<std::thread> threads_;
};

/// Writes steps behind the comparison.
class Writing {
 public:
  Writing(SequenceWriter& writer, size_t stepCount, const ProgressCallback& progress)
      : writer_(writer), stepCount_(stepCount), progress_(progress), thread_([this] { writeAll(); }) {}
  ~Writing() { end(); }

  /// False once writing has failed.
  bool put(ComparedStep step) { return queue_.push(std::move(step)); }

  /// Waits for what was put; throws what writing threw.
  void finish() {
    end();
    if (failure_) std::rethrow_exception(failure_);
  }
  bool failed() const { return failed_; }

 private:
  void end() {
    queue_.close();
    if (thread_.joinable()) thread_.join();
  }

  void writeAll() noexcept {
    try {
      while (const std::optional<ComparedStep> step = queue_.pop()) {
        writer_.write(step->entry, step->key.get(), step->changes.get());
        if (progress_) progress_(int64_t(writer_.manifest().steps.size()), int64_t(stepCount_));
      }
    } catch (...) {
      failure_ = std::current_exception();
      failed_ = true;
      queue_.close();
    }
  }

  SequenceWriter& writer_;
  const size_t stepCount_;
  const ProgressCallback& progress_;
  BoundedQueue<ComparedStep> queue_{1};
  std::exception_ptr failure_;
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

SequenceStep entryOf(const LoadedStep& loaded, int64_t step) {
  SequenceStep entry;
  entry.step = step;
  entry.activeVoxels = loaded.activeVoxels;
  entry.range = {float(loaded.statistics.lo), float(loaded.statistics.hi)};
  entry.nonFinite = loaded.statistics.nonFinite;
  return entry;
}

/// The middle stage: holds the reconstruction and hands each step's changes on.
class Comparing {
 public:
  Comparing(const InputSeries& input, const SequenceManifest& wanted, ThreadPool& pool)
      : input_(input), tolerance_(wanted.tolerance), keyEvery_(wanted.keyEvery), pool_(pool) {}

  void resume(const SequenceManifest& found, const std::string& directory) {
    try {
      detector_.emplace(SequenceReader(directory).readStep(found.steps.size() - 1), tolerance_);
    } catch (const Error& e) {
      throw Error(std::string(e.what()) +
                  " (of an earlier run, which cannot be resumed; --overwrite starts anew)");
    }
  }

  ComparedStep compare(size_t index, LoadedStep loaded) {
    ComparedStep step{entryOf(loaded, input_.steps()[index].step), nullptr, nullptr};
    if (!detector_)
      detector_.emplace(std::move(loaded.field), tolerance_);
    else
      step.changes = std::make_unique<ChangedVoxels>(detector_->advance(std::move(loaded.field), pool_));
    if (isKey(index)) step.key = std::make_unique<Field>(detector_->reconstruction());
    step.entry.changedVoxels = step.changes ? step.changes->count() : 0;
    step.entry.stateChecksum = detector_->state();
    return step;
  }

 private:
  bool isKey(size_t index) const { return keyEvery_ > 0 ? index % size_t(keyEvery_) == 0 : index == 0; }

  const InputSeries& input_;
  const double tolerance_;
  const int keyEvery_;
  ThreadPool& pool_;
  std::optional<ChangeDetector> detector_;
};

/// Warns of the first step with NaN or infinite voxels, and of no other.
class NonFiniteWarning {
 public:
  NonFiniteWarning(const InputSeries& input, const StaticPhaseReports& reports, const SequenceManifest& found)
      : input_(input), reports_(reports) {
    for (const SequenceStep& s : found.steps) warned_ = warned_ || s.nonFinite > 0;
  }
  void see(size_t index, const LoadedStep& loaded) {
    if (warned_ || loaded.statistics.nonFinite == 0) return;
    warned_ = true;
    if (reports_.warning)
      reports_.warning("warning: " + input_.steps()[index].path + ": " +
                       std::to_string(loaded.statistics.nonFinite) +
                       " voxels are NaN or infinite; the sequence keeps them, rendering shows nothing there");
  }

 private:
  const InputSeries& input_;
  const StaticPhaseReports& reports_;
  bool warned_ = false;
};

int readerCount(const ThreadPool& pool) {
  return pool.threads() > 2 ? 2 : 1;
}

}  // namespace

void runStaticPhase(const InputSeries& input, SequenceWriter& writer, const std::string& directory,
                    ThreadPool& pool, const StopFlag& stop, const StaticPhaseReports& reports) {
  const SequenceManifest found = writer.manifest();  // the writing thread changes the writer's
  const size_t first = found.steps.size(), count = input.steps().size();
  if (first < count) {
    stop.check();
    Comparing comparing(input, found, pool);
    NonFiniteWarning warning(input, reports, found);
    if (first > 0) comparing.resume(found, directory);
    Writing writing(writer, count, reports.progress);
    Reading reading(input, first, readerCount(pool));
    try {
      for (size_t i = first; i < count && !writing.failed(); ++i) {
        stop.check();
        LoadedStep loaded = reading.take(i);
        warning.see(i, loaded);
        if (!writing.put(comparing.compare(i, std::move(loaded)))) break;
      }
    } catch (...) {
      writing.finish();  // its own failure, if any, came first
      throw;
    }
    writing.finish();
  }
  writer.finish();
}

SequenceManifest emptyManifest(const InputSeries& input, double tolerance, int keyEvery) {
  SequenceManifest manifest;
  manifest.lattice = input.lattice();
  manifest.gridName = input.gridName();
  manifest.tolerance = tolerance;
  manifest.keyEvery = keyEvery;
  for (const StepFile& file : input.steps())
    manifest.inputs.push_back(std::filesystem::path(file.path).filename().string());
  return manifest;
}

}  // namespace kairos
