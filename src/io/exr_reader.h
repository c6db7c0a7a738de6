// EXR images already in memory; `path` is for messages.
#pragma once

#include <span>
#include <string>

#include "io/image_file.h"

namespace kairos {

Image readExr(const std::string& path, std::span<const char> bytes);
Metadata readExrMetadata(const std::string& path, std::span<const char> bytes);

}  // namespace kairos
