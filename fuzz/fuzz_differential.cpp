// The files of a sequence behind their hashes: the first byte says whether the rest is a key frame or a
// differential file, of which element type. A manifest is written beside it that agrees with whatever the
// file says of itself, so that damage reaches the values.
#include "fuzz/fuzz_input.h"
#include "io/file_bytes.h"
#include "io/manifest.h"
#include "io/vdb_container.h"

namespace {

using namespace kairos;

uint64_t checksumIn(const VdbMetadata& metadata, const char* key) {
  const std::string digits = metadata.string(key).value_or("");
  try {
    return valueOfHex(digits);
  } catch (const std::invalid_argument&) {
    return 0;
  }
}

SequenceManifest vouchingFor(const VdbGridHeader& grid, std::string_view bytes, ElementType type) {
  SequenceManifest manifest;
  manifest.lattice.type = type;
  manifest.lattice.domain = {{0, 0, 0}, {64, 64, 64}};
  manifest.lattice.worldFromIndex = grid.transform.value_or(Affine{});
  manifest.lattice.background = grid.background;
  manifest.gridName = grid.name;
  manifest.inputs = {"a", "b"};
  SequenceStep key, differential;
  key.step = grid.metadata.integer("kairos_previous_step").value_or(21);
  key.key = true;
  differential.step = grid.metadata.integer("kairos_step").value_or(22);
  differential.differential = true;
  key.keyBytes = differential.differentialBytes = bytes.size();
  key.keyHash = differential.differentialHash = xxh64(bytes);
  differential.changedVoxels = uint64_t(grid.metadata.integer("kairos_changed_voxels").value_or(0));
  key.stateChecksum = checksumIn(grid.metadata, "kairos_state_before");
  differential.stateChecksum = checksumIn(grid.metadata, "kairos_state_after");
  manifest.steps = {key, differential};
  manifest.complete = true;
  return manifest;
}

SequenceManifest keyFrameManifest(SequenceManifest manifest) {
  SequenceStep key = manifest.steps[0];
  key.step = manifest.steps[1].step;
  key.stateChecksum = manifest.steps[1].stateChecksum;
  manifest.steps = {key};
  manifest.inputs = {"a"};
  return manifest;
}

// A file whose name the input chooses: gone afterwards, or they would pile up.
struct NamedFile {
  NamedFile(std::string name, std::string_view bytes) : path(std::move(name)) {
    std::ofstream(path, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), std::streamsize(bytes.size()));
  }
  ~NamedFile() { std::filesystem::remove(path); }
  const std::string path;
};

void read(const fuzz::ScratchDirectory& directory, std::string_view bytes, int kind) {
  ByteReader reader("input.vdb", std::span<const char>(bytes));
  const VdbContainer container = readVdbContainer(reader);
  if (container.grids.empty()) return;
  SequenceManifest manifest = vouchingFor(container.grids[0], bytes, ElementType(kind % 3));
  const bool key = kind / 3 % 2 != 0;
  if (key) manifest = keyFrameManifest(std::move(manifest));
  const std::string path = directory.path();
  const int64_t step = manifest.steps.back().step;
  directory.write("sequence.json", manifestText(manifest));
  const NamedFile file(key ? keyPathOf(path, step) : differentialPathOf(path, step), bytes);
  const SequenceReader sequence(path);
  if (key)
    sequence.readKey(0);
  else
    sequence.readChanges(1);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::ScratchDirectory directory;
  if (size < 1) return 0;
  const std::string_view bytes = fuzz::textOf(data + 1, size - 1);
  return fuzz::readOrRefused([&] { read(directory, bytes, data[0]); });
}
