// Raw files: four bytes choose dimensions, type and whether the size is right, the rest is the file.
#include "fuzz/fuzz_input.h"
#include "io/input_series.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  static const fuzz::ScratchDirectory directory;
  if (size < 4) return 0;
  RawFormat format;
  format.dims = {1 + data[0] % 12, 1 + data[1] % 12, 1 + data[2] % 12};
  format.type = ElementType(data[3] % 3);
  std::string bytes(fuzz::textOf(data + 4, size - 4));
  if (data[3] >= 128)
    bytes.resize(size_t(format.dims.x) * size_t(format.dims.y) * size_t(format.dims.z) *
                 size_t(bytesPerVoxel(format.type)));
  const std::string file = directory.write("s_0001.raw", bytes);
  return fuzz::readOrRefused([&] {
    const Field field = InputSeries::open({file}, {"", format})->read(0);
    fieldStatistics(field);
    stateChecksum(field);
  });
}
