// The built-in perceptual colour maps.
#pragma once

#include <string>
#include <vector>

#include "core/transfer_function.h"

namespace kairos {

/// Names of the built-in maps, the default first.
const std::vector<std::string>& colourMapNames();

/// A built-in map over [0, 1] with the default opacity ramp: the lowest values transparent, rising smoothly.
/// Throws OptionError (naming all maps) for an unknown name.
TransferFunction builtInTransferFunction(const std::string& name);

}  // namespace kairos
