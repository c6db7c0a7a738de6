// The precondition of every image metric.
#pragma once

#include "core/image.h"

namespace kairos {

/// Throws OptionError, naming what was found, unless both images have 4 channels and the same size.
void requireComparable(const Image& a, const Image& b);

}  // namespace kairos
