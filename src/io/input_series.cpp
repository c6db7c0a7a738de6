#include "io/input_series.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "core/error.h"
#include "io/series_formats.h"

namespace kairos {
namespace {

bool isVdb(const StepFile& file) {
  std::string extension = std::filesystem::path(file.path).extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".vdb";
}

}  // namespace

std::unique_ptr<InputSeries> InputSeries::open(const std::vector<std::string>& inputs,
                                               const InputOptions& options) {
  std::vector<StepFile> steps = findStepFiles(inputs);
  const auto vdbCount = size_t(std::count_if(steps.begin(), steps.end(), isVdb));
  if (vdbCount != 0 && vdbCount != steps.size()) {
    const auto other = std::find_if_not(steps.begin(), steps.end(), isVdb);
    throw InputError(other->path, "is not a .vdb file as others of this series are");
  }
  if (vdbCount > 0) {
    if (options.raw)
      throw OptionError("--dims", "is for raw files, but " + steps.front().path + " is an OpenVDB file");
    return openVdbSeries(std::move(steps), options.grid);
  }
  if (!options.raw)
    throw OptionError("--dims",
                      "required for the headerless file " + steps.front().path + ", expected X,Y,Z");
  if (!options.grid.empty())
    throw OptionError("--grid", "is for OpenVDB files, but " + steps.front().path + " is read as raw voxels");
  return openRawSeries(std::move(steps), *options.raw);
}

}  // namespace kairos
