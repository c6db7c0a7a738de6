// A sequence: what the static phase writes and the dynamic phase reads. A directory with
//   sequence.json         the manifest
//   key.NNNN.vdb          key frames: the whole field of a step (the first, and every N-th if asked)
//   diff.NNNN.vdb         differential files: the changed voxels of a step against the one before
// NNNN is the time step's own number. docs/file-formats.md is the specification.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/transfer_function.h"
#include "volume/changed_voxels.h"
#include "volume/field.h"

namespace kairos {

/// One step of the manifest.
struct SequenceStep {
  int64_t step = 0;
  bool key = false;            // key.NNNN.vdb exists
  bool differential = false;   // diff.NNNN.vdb exists (all steps but the first)
  uint64_t changedVoxels = 0;  // 0 for the first step
  uint64_t activeVoxels = 0;   // voxels that differ from the background
  uint64_t bytes = 0;          // size of its files
  uint64_t keyBytes = 0, differentialBytes = 0;
  uint64_t keyHash = 0, differentialHash = 0;  // XXH64 of the whole files: checked before they are parsed
  uint64_t stateChecksum = 0;
  ValueRange range;       // finite values of the step, background included
  int64_t nonFinite = 0;  // NaN and infinite voxels
};

/// Contents of sequence.json.
struct SequenceManifest {
  Lattice lattice;
  std::string gridName;  // of the simulation's files and of the sequence's
  double tolerance = 0;
  int keyEvery = 0;                 // 0: only the first step
  std::vector<std::string> inputs;  // the simulation's file names, without their directories
  std::vector<SequenceStep> steps;
  bool complete = false;  // false while the static phase has steps to go

  /// Over all steps.
  ValueRange range() const;
};

/// Reads and checks DIR/sequence.json. Throws InputError naming the file and the entry.
SequenceManifest readManifest(const std::string& directory);
/// Is `path` a directory that holds a sequence.json?
bool isSequence(const std::string& path);

/// Writes the steps of a sequence in order. The manifest is renewed as they come, so an interrupted run
/// resumes: after each of the first steps, then every few seconds or when a sixteenth has come to them (it
/// grows with them), and by the destructor. Every file is written beside its final name and renamed; a failed
/// write leaves nothing behind. Throws OutputError.
class SequenceWriter {
 public:
  /// Creates the directory if needed. With a manifest of an interrupted run there whose lattice, grid,
  /// inputs, tolerance and keyEvery agree, goes on after its last step (`manifest().steps`); with one that
  /// differs, a finished or a damaged one, throws OutputError saying so. With `overwrite` it always starts
  /// afresh and removes the old files.
  SequenceWriter(std::string directory, SequenceManifest manifest, bool overwrite);
  /// Renews the manifest if it lacks steps; errors are dropped.
  ~SequenceWriter();
  SequenceWriter(const SequenceWriter&) = delete;
  SequenceWriter& operator=(const SequenceWriter&) = delete;

  const SequenceManifest& manifest() const { return manifest_; }
  /// `key`, `differential` and everything about the files is filled in here. `changes` is null for the first
  /// step; `key` is null where no key frame is due.
  void write(SequenceStep entry, const Field* key, const ChangedVoxels* changes);
  void finish();

 private:
  bool renewalIsDue() const;
  void renewManifest();

  std::string directory_;
  SequenceManifest manifest_;
  size_t stepsInFile_ = 0;  // of the manifest's file
  std::chrono::steady_clock::time_point renewed_ = std::chrono::steady_clock::now();
};

/// Random access to the steps of a sequence; safe to use from several threads.
class SequenceReader {
 public:
  explicit SequenceReader(std::string directory);

  const SequenceManifest& manifest() const { return manifest_; }
  const std::string& directory() const { return directory_; }
  size_t stepCount() const { return manifest_.steps.size(); }

  /// The field of key frame `index`, its checksum verified.
  Field readKey(size_t index) const;
  /// The changed voxels that lead from step index - 1 to step index: of a file whose bytes have the
  /// manifest's checksum, with stateBefore/stateAfter set from the file and compared with the manifest.
  /// Throws InputError or StateError.
  ChangedVoxels readChanges(size_t index) const;
  /// Any step: the nearest key frame at or before it, then the differential files from there.
  Field readStep(size_t index) const;
  /// Bytes on disk of the step's differential file (or of its key frame, for the first step).
  uint64_t bytes(size_t index) const;

  std::string keyPath(size_t index) const;
  std::string differentialPath(size_t index) const;

 private:
  std::string directory_;
  SequenceManifest manifest_;
};

}  // namespace kairos
