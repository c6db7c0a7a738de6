// A simulation's time series as its files: found, checked, and read one step at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/field.h"

namespace kairos {

/// What a headerless raw file does not say of itself. Values are little-endian, x fastest.
struct RawFormat {
  Vec3i dims;
  ElementType type = ElementType::u8;
  Vec3d voxelSize{1, 1, 1};  // index (i, j, k) stands at world (i, j, k) * voxelSize
};

struct InputOptions {
  std::string grid;              // OpenVDB grid name; empty: the only sensible one
  std::optional<RawFormat> raw;  // required for raw files, refused for .vdb files
};

/// Expands INPUT arguments (files, directories, globs, `####` and `%04d` patterns) to files in natural order
/// with the time step of each: the last run of digits in its file name, or its position where there is none
/// in every name or two files share one. Throws InputError when nothing matches or a file does not exist.
struct StepFile {
  std::string path;
  int64_t step;
};
std::vector<StepFile> findStepFiles(const std::vector<std::string>& inputs);

/// All steps of one series. Opening reads headers and metadata only, unless a .vdb file lacks the bounding
/// box there. Every step must share element type, transform and background; the InputError says which step
/// breaks it and how. `read` is safe to call from several threads.
class InputSeries {
 public:
  virtual ~InputSeries() = default;

  static std::unique_ptr<InputSeries> open(const std::vector<std::string>& inputs,
                                           const InputOptions& options);

  const Lattice& lattice() const { return lattice_; }
  const std::vector<StepFile>& steps() const { return steps_; }
  /// Name of the VDB grid that is read; empty for raw files.
  const std::string& gridName() const { return gridName_; }

  /// The field of steps()[index]. Throws InputError when the file is damaged or changed since `open`.
  virtual Field read(size_t index) const = 0;
  /// Bytes that `read(index)` takes from disk (the file's size where the format cannot say better).
  virtual uint64_t bytes(size_t index) const = 0;

 protected:
  Lattice lattice_;
  std::vector<StepFile> steps_;
  std::string gridName_;
};

}  // namespace kairos
