// A simulation's OpenVDB file: container, tree and values.
#include "fuzz/fuzz_input.h"
#include "io/input_series.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  static const fuzz::ScratchDirectory directory;
  const std::string file = directory.write("s_0001.vdb", fuzz::textOf(data, size));
  return fuzz::readOrRefused([&] { InputSeries::open({file}, {})->read(0); });
}
