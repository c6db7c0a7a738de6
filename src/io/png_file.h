// PNG images in memory, through libpng; `path` is for messages.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/image.h"

namespace kairos {

/// 8-bit sRGB over black, opaque. Throws OutputError.
std::vector<char> encodePng(const std::string& path, const Image& rgba);
/// Any PNG as linear premultiplied RGBA. Throws InputError.
Image decodePng(const std::string& path, std::span<const char> bytes);

}  // namespace kairos
