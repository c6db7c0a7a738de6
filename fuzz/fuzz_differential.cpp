// The files of a sequence behind their hashes: the first byte says whether the rest is a key frame or a
// differential file, of which element type; a manifest that vouches for it is written beside it.
#include "fuzz/fuzz_input.h"
#include "io/file_bytes.h"
#include "io/manifest.h"

namespace {

using namespace kairos;

SequenceManifest vouchingFor(std::string_view bytes, ElementType type) {
  SequenceManifest manifest;
  manifest.lattice.type = type;
  manifest.lattice.domain = {{0, 0, 0}, {64, 64, 64}};
  manifest.gridName = "density";
  manifest.inputs = {"a", "b"};
  SequenceStep key, differential;
  key.step = 21;
  key.key = true;
  differential.step = 22;
  differential.differential = true;
  key.keyBytes = differential.differentialBytes = bytes.size();
  key.keyHash = differential.differentialHash = xxh64(bytes);
  manifest.steps = {key, differential};
  manifest.complete = true;
  return manifest;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::ScratchDirectory directory;
  if (size < 1) return 0;
  const std::string_view bytes = fuzz::textOf(data + 1, size - 1);
  directory.write("sequence.json", manifestText(vouchingFor(bytes, ElementType(data[0] % 3))));
  directory.write("key.0021.vdb", bytes);
  directory.write("diff.0022.vdb", bytes);
  return fuzz::readOrRefused([&] {
    const SequenceReader reader(directory.path());
    if (data[0] / 3 % 2 != 0)
      reader.readKey(0);
    else
      reader.readChanges(1);
  });
}
