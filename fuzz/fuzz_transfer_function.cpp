// Transfer functions: ParaView's JSON and rows of numbers, up to the classification table.
#include "fuzz/fuzz_input.h"
#include "io/transfer_function_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace kairos;
  static const fuzz::ScratchDirectory directory;
  const std::string file = directory.write("tf", fuzz::textOf(data, size));
  return fuzz::readOrRefused([&] {
    const TransferFunction tf = readTransferFunction(file);
    try {
      ClassificationTable(tf, tf.domain(), 1);
    } catch (const OptionError&) {  // a domain that no float can resolve
    }
  });
}
