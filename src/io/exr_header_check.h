// What an EXR file claims, held against the bytes it has, before OpenEXR makes room for it.
#pragma once

#include <span>
#include <string>

namespace kairos {

/// OpenEXR reserves what a header claims before it misses the bytes: an attribute's size, the table of a
/// part's chunks, the lines or tiles of one chunk. This walks the headers of all parts and throws InputError
/// where an attribute, a chunk table or the pixels could not be in a file of this size, and for deep images.
/// It does not find all damage: what remains is OpenEXR's to refuse.
void checkExrHeader(const std::string& path, std::span<const char> bytes);

}  // namespace kairos
