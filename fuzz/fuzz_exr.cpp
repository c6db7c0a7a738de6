// EXR images and their attributes, as compare and --resume read them.
#include "fuzz/fuzz_input.h"
#include "io/exr_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  const std::span<const char> bytes(reinterpret_cast<const char*>(data), size);
  fuzz::readOrRefused([&] { readExrMetadata("input.exr", bytes); });
  return fuzz::readOrRefused([&] { readExr("input.exr", bytes); });
}
