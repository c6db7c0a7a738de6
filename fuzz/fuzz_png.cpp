// PNG images, as compare and --resume read them.
#include "fuzz/fuzz_input.h"
#include "io/png_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  return fuzz::readOrRefused([&] { decodePng("input.png", {reinterpret_cast<const char*>(data), size}); });
}
