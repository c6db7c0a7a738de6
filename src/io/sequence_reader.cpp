#include <filesystem>
#include <string_view>

#include "core/error.h"
#include "io/file_bytes.h"
#include "io/manifest.h"
#include "io/sequence.h"
#include "io/vdb_container.h"
#include "io/vdb_field.h"

namespace kairos {
namespace {

// A key frame or differential file whose bytes are those the manifest tells of.
class SequenceFile {
 public:
  SequenceFile(const SequenceManifest& manifest, std::string path, uint64_t bytes, uint64_t hash)
      : manifest_(manifest), path_(std::move(path)), bytes_(verified(bytes, hash)) {
    ByteReader reader(path_, bytes_);
    container_ = readVdbContainer(reader);
    const std::string name = gridNameInFiles(manifest);
    grid_ = container_.find(name);
    if (!grid_) throw InputError(path_, "has no grid \"" + name + "\"; it holds " + container_.gridList());
  }

  // Is this the file of that step, with the sequence's lattice?
  void requireBelongs(const char* kind, const SequenceStep& entry) const {
    requireFloats();
    const Lattice& lattice = manifest_.lattice;
    require("kairos_kind", std::string(kind));
    require("kairos_element_type", std::string(name(lattice.type)));
    require("kairos_state_after", hexOf(entry.stateChecksum));
    require("kairos_step", entry.step);
    if (!grid_->transform || !(*grid_->transform == lattice.worldFromIndex) ||
        float(grid_->background) != float(lattice.background))
      throw InputError(path_, "has another transform or background than the sequence");
  }

  void requireFloats() const {
    const VdbGridType* type = grid_->type();
    if (!type || std::string_view(type->valueName) != "float")
      throw InputError(path_, "grid \"" + grid_->name + "\" has type " + grid_->typeName +
                                  ", expected float as in every file of a sequence");
  }

  void require(const char* key, const std::string& expected) const {
    const auto found = grid_->metadata.string(key);
    if (found != expected)
      throw InputError(path_,
                       std::string(key) + " is " + found.value_or("missing") + ", expected " + expected);
  }
  void require(const char* key, int64_t expected) const {
    const auto found = grid_->metadata.integer(key);
    if (found != expected)
      throw InputError(path_, std::string(key) + " is " + (found ? std::to_string(*found) : "missing") +
                                  ", expected " + std::to_string(expected));
  }

  Field field() const { return fieldFromTree(path_, *grid_, tree(), manifest_.lattice.type); }
  ChangedVoxels changes() const { return changesFromTree(path_, *grid_, tree(), manifest_.lattice.type); }

 private:
  ByteBuffer verified(uint64_t size, uint64_t hash) const {
    const InputFile file(path_);
    if (file.size() != size)
      throw InputError(path_,
                       "has " + std::to_string(file.size()) + " bytes, expected " + std::to_string(size));
    ByteBuffer bytes = file.read(0, size);
    if (xxh64(bytes) != hash)
      throw InputError(path_, "is damaged: its checksum is not that of sequence.json");
    return bytes;
  }

  std::span<const char> tree() const {
    if (grid_->end > bytes_.size()) throw InputError(path_, "is damaged: its grid reaches beyond its end");
    return std::span<const char>(bytes_).subspan(size_t(grid_->treeBegin),
                                                 size_t(grid_->end - grid_->treeBegin));
  }

  const SequenceManifest& manifest_;
  std::string path_;
  ByteBuffer bytes_;
  VdbContainer container_;
  const VdbGridHeader* grid_ = nullptr;
};

}  // namespace

SequenceReader::SequenceReader(std::string directory)
    : directory_(std::move(directory)), manifest_(readManifest(directory_)) {
  if (manifest_.steps.empty()) throw InputError(manifestPath(directory_), "holds no steps yet");
}

Field SequenceReader::readKey(size_t index) const {
  const SequenceStep& entry = manifest_.steps.at(index);
  if (!entry.key)
    throw InputError(keyPath(index), "step " + std::to_string(entry.step) + " has no key frame");
  const SequenceFile file(manifest_, keyPath(index), entry.keyBytes, entry.keyHash);
  file.requireBelongs("key", entry);
  Field field = file.field();
  if (stateChecksum(field) != entry.stateChecksum)
    throw InputError(keyPath(index), "does not hold the state of step " + std::to_string(entry.step));
  return field;
}

ChangedVoxels SequenceReader::readChanges(size_t index) const {
  const SequenceStep& entry = manifest_.steps.at(index);
  if (!entry.differential)
    throw InputError(differentialPath(index),
                     "step " + std::to_string(entry.step) + " has no differential file");
  const SequenceStep& previous = manifest_.steps.at(index - 1);
  const SequenceFile file(manifest_, differentialPath(index), entry.differentialBytes,
                          entry.differentialHash);
  file.requireBelongs("differential", entry);
  file.require("kairos_previous_step", previous.step);
  file.require("kairos_state_before", hexOf(previous.stateChecksum));
  ChangedVoxels changes = file.changes();
  file.require("kairos_changed_voxels", int64_t(changes.count()));
  changes.stateBefore = previous.stateChecksum;
  changes.stateAfter = entry.stateChecksum;
  return changes;
}

Field SequenceReader::readStep(size_t index) const {
  size_t from = index;
  while (!manifest_.steps.at(from).key) --from;  // the first step always is one
  Field field = readKey(from);
  if (from == index) return field;
  while (from < index) applyChanges(readChanges(++from), field);
  if (stateChecksum(field) != manifest_.steps[index].stateChecksum)
    throw StateError(differentialPath(index) + ": the differential files do not lead to the state of step " +
                     std::to_string(manifest_.steps[index].step));
  return field;
}

uint64_t SequenceReader::bytes(size_t index) const {
  const SequenceStep& entry = manifest_.steps.at(index);
  return entry.differential ? entry.differentialBytes : entry.keyBytes;
}

std::string SequenceReader::keyPath(size_t index) const {
  return keyPathOf(directory_, manifest_.steps.at(index).step);
}
std::string SequenceReader::differentialPath(size_t index) const {
  return differentialPathOf(directory_, manifest_.steps.at(index).step);
}

}  // namespace kairos
