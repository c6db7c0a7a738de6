// Transfer functions in files: ParaView colour-map JSON, and rows of "value r g b a".
#pragma once

#include <string>

#include "core/transfer_function.h"

namespace kairos {

/// Reads `path`: a ParaView colour-map JSON (an array of objects or one object; RGBPoints with ColorSpace,
/// and Points for opacity: value, opacity, midpoint, sharpness) when it starts with '[' or '{', else rows of
/// `value r g b a` with # comments. Colours of JSON files are sRGB and are converted to linear; those of text
/// rows are linear already. Throws InputError naming the line or entry.
TransferFunction readTransferFunction(const std::string& path);

}  // namespace kairos
