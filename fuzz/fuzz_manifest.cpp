// sequence.json behind its checksum: the input is the text before it.
#include "fuzz/fuzz_input.h"
#include "io/file_bytes.h"
#include "io/manifest.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  static const fuzz::ScratchDirectory directory;
  std::string text(fuzz::textOf(data, size));
  text += "\n\"checksum\": \"" + hexOf(xxh64(text)) + "\"\n}\n";
  directory.write("sequence.json", text);
  return fuzz::readOrRefused([&] {
    // What was accepted is written back and accepted again.
    const SequenceManifest manifest = readManifest(directory.path());
    directory.write("sequence.json", manifestText(manifest));
    readManifest(directory.path());
  });
}
