// Where the time steps come from: a sequence, or a simulation's files whose changes are found while reading.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "app/input_arguments.h"
#include "app/option_values.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/transfer_function.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

/// One time step as a renderer takes it: whole, or what changed since the one before.
struct LoadedStep {
  size_t index = 0;
  std::variant<Field, ChangedVoxels> content;
  double loadMs = 0;
  uint64_t bytesRead = 0;
  int64_t nonFinite = 0;  // NaN and infinite voxels of the whole step
};

/// Steps in order of time. Not thread-safe: one thread at a time.
class StepSource {
 public:
  virtual ~StepSource() = default;

  const Lattice& lattice() const { return lattice_; }
  /// The time steps' own numbers, ascending.
  const std::vector<int64_t>& steps() const { return steps_; }
  /// How the input is called in messages, and one of its steps.
  virtual std::string name() const = 0;
  virtual std::string stepName(size_t index) const = 0;

  /// Of all finite values of all steps. May read everything once; throws Interrupted.
  virtual ValueRange valueRange(const ProgressCallback& progress, const StopFlag& stop) = 0;

  /// A hash that changes when the step's content does, as seen from `first` (the step that `start` was
  /// given).
  virtual uint64_t identity(size_t first, size_t index) const = 0;
  /// Can `start` go to any step without the ones before it, with the same result?
  virtual bool seekable() const = 0;

  /// The whole of a step, from which `next` goes on.
  virtual LoadedStep start(size_t index) = 0;
  /// The changes that lead to the step after the last one returned.
  virtual LoadedStep next() = 0;

 protected:
  Lattice lattice_;
  std::vector<int64_t> steps_;
};

/// Positions in `steps()`, both included.
struct SelectedSteps {
  size_t first = 0, last = 0;
};

/// The steps of a source inside `range`, which `text` names after `option`. Throws OptionError when there are
/// none.
SelectedSteps selectSteps(const StepSource& source, const StepRange& range, const std::string& option,
                          const std::string& text);

/// Opens INPUT. `tolerance` is for simulation files, where changes are found here: 0, or the error a voxel
/// may have. The pool must outlive the source. Throws InputError and OptionError.
std::unique_ptr<StepSource> openStepSource(const InputArguments& input, double tolerance, ThreadPool& pool);

}  // namespace kairos
