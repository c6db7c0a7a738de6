#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/manifest.h"
#include "io/sequence.h"
#include "io/vdb_writer.h"

namespace kairos {
namespace {

namespace fs = std::filesystem;

bool hasSize(const std::string& path, uint64_t bytes) {
  std::error_code error;
  const uint64_t size = fs::file_size(path, error);
  return !error && size == bytes;
}

bool filesArePresent(const std::string& directory, const SequenceStep& s) {
  return (!s.key || hasSize(keyPathOf(directory, s.step), s.keyBytes)) &&
         (!s.differential || hasSize(differentialPathOf(directory, s.step), s.differentialBytes));
}

// The steps of an interrupted run that can be kept. Throws when this is another sequence, or a finished one.
std::vector<SequenceStep> stepsToKeep(const std::string& directory, const SequenceManifest& wanted) {
  SequenceManifest found;
  try {
    found = readManifest(directory);
  } catch (const InputError& e) {
    throw OutputError(directory, std::string("holds a sequence that cannot be resumed (") + e.what() + ")");
  }
  const std::string difference = manifestDifference(found, wanted);
  if (!difference.empty()) throw OutputError(directory, "holds another sequence already, with " + difference);
  if (found.complete) throw OutputError(directory, "holds this sequence already, finished");
  size_t keep = 0;
  while (keep < found.steps.size() && filesArePresent(directory, found.steps[keep])) ++keep;
  found.steps.resize(keep);
  return found.steps;
}

bool isSequenceFile(const std::string& name) {
  const bool numbered = name.starts_with("key.") || name.starts_with("diff.");
  const size_t digits = name.find('.') + 1, end = name.find_first_not_of("0123456789", digits);
  return numbered && end != std::string::npos && end > digits && name.substr(end) == ".vdb";
}

// The manifest goes first: what remains after an interruption is no sequence any more.
void removeSequence(const std::string& directory) {
  std::error_code error;
  fs::remove(manifestPath(directory), error);
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error))
    if (isSequenceFile(entry.path().filename().string())) fs::remove(entry.path(), error);
}

// What key frames and differential files say of themselves.
std::vector<VdbMetadataEntry> metadataOf(const SequenceManifest& m, const SequenceStep& entry,
                                         const char* kind) {
  return {{"kairos_format", int64_t(1)},
          {"kairos_kind", std::string(kind)},
          {"kairos_step", entry.step},
          {"kairos_element_type", std::string(name(m.lattice.type))},
          {"kairos_range_lo", double(entry.range.lo)},
          {"kairos_range_hi", double(entry.range.hi)},
          {"kairos_tolerance", m.tolerance},
          {"kairos_state_after", hexOf(entry.stateChecksum)}};
}

std::string encodedChanges(const SequenceManifest& m, const SequenceStep& entry,
                           const ChangedVoxels& changes) {
  const SequenceStep& previous = m.steps.back();
  if (changes.type() != m.lattice.type)
    throw StateError("changed voxels hold " + std::string(name(changes.type())) + " values, the sequence " +
                     std::string(name(m.lattice.type)));
  if ((changes.stateBefore && *changes.stateBefore != previous.stateChecksum) ||
      (changes.stateAfter && *changes.stateAfter != entry.stateChecksum))
    throw StateError("the changed voxels of step " + std::to_string(entry.step) + " do not lead from step " +
                     std::to_string(previous.step) + " to it");
  auto metadata = metadataOf(m, entry, "differential");
  metadata.insert(metadata.end(), {{"kairos_previous_step", previous.step},
                                   {"kairos_changed_voxels", int64_t(changes.count())},
                                   {"kairos_state_before", hexOf(previous.stateChecksum)},
                                   {"kairos_content", hexOf(contentChecksum(changes))}});
  return vdbFromChanges(changes, m.lattice, gridNameInFiles(m), metadata);
}

}  // namespace

SequenceWriter::SequenceWriter(std::string directory, SequenceManifest manifest, bool overwrite)
    : directory_(std::move(directory)), manifest_(std::move(manifest)) {
  manifest_.complete = false;
  manifest_.steps.clear();
  makeWritableDirectory(directory_);
  if (overwrite)
    removeSequence(directory_);
  else if (isSequence(directory_))
    manifest_.steps = stepsToKeep(directory_, manifest_);
  stepsInFile_ = manifest_.steps.size();
}

SequenceWriter::~SequenceWriter() {
  try {
    if (stepsInFile_ < manifest_.steps.size()) renewManifest();
  } catch (...) {
    // An earlier run's end is as good; this one's steps are found again.
  }
}

bool SequenceWriter::renewalIsDue() const {
  constexpr size_t kAlways = 64, kShare = 16;
  constexpr std::chrono::seconds kLongest{5};
  const size_t steps = manifest_.steps.size();
  return steps <= kAlways || steps - stepsInFile_ >= steps / kShare ||
         std::chrono::steady_clock::now() - renewed_ >= kLongest;
}

void SequenceWriter::renewManifest() {
  writeFileAtomically(manifestPath(directory_), manifestText(manifest_));
  stepsInFile_ = manifest_.steps.size();
  renewed_ = std::chrono::steady_clock::now();
}

void SequenceWriter::write(SequenceStep entry, const Field* key, const ChangedVoxels* changes) {
  const bool first = manifest_.steps.empty();
  if (first ? !key || changes : !changes)
    throw StateError(
        "step " + std::to_string(entry.step) +
        (first ? ": the first step of a sequence is a key frame" : ": changed voxels are missing"));
  if (!first && entry.step <= manifest_.steps.back().step)
    throw StateError("step " + std::to_string(entry.step) + " does not come after step " +
                     std::to_string(manifest_.steps.back().step));
  entry.key = key != nullptr;
  entry.differential = changes != nullptr;
  if (changes) {
    const std::string bytes = encodedChanges(manifest_, entry, *changes);
    entry.differentialBytes = bytes.size();
    entry.differentialHash = xxh64(bytes);
    writeFileAtomically(differentialPathOf(directory_, entry.step), bytes);
  }
  if (key) {
    const std::string bytes = vdbFromField(*key, manifest_.lattice, gridNameInFiles(manifest_),
                                           metadataOf(manifest_, entry, "key"));
    entry.keyBytes = bytes.size();
    entry.keyHash = xxh64(bytes);
    writeFileAtomically(keyPathOf(directory_, entry.step), bytes);
  }
  entry.bytes = entry.keyBytes + entry.differentialBytes;
  manifest_.steps.push_back(entry);
  if (renewalIsDue()) renewManifest();
}

void SequenceWriter::finish() {
  manifest_.complete = true;
  renewManifest();
}

}  // namespace kairos
