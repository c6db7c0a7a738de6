// The formats behind InputSeries::open.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/input_series.h"

namespace kairos {

std::unique_ptr<InputSeries> openRawSeries(std::vector<StepFile> steps, const RawFormat& format);
std::unique_ptr<InputSeries> openVdbSeries(std::vector<StepFile> steps, const std::string& grid);

}  // namespace kairos
