// Image files: EXR through OpenEXR, PNG through libpng.
#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/camera.h"
#include "core/image.h"

namespace kairos {

enum class ExrCompression { none, zips, zip, piz };

struct ExrOptions {
  bool half = true;  // 16-bit float RGBA; AOVs are always 32-bit float
  ExrCompression compression = ExrCompression::zip;
  double framesPerSecond = 25;
};

/// A single-channel image beside the colour, written as an EXR channel of that name ("Z" for depth).
struct ExrChannel {
  std::string name;
  const Image* image;
};

using MetadataValue = std::variant<std::string, int, float, double>;
using Metadata = std::map<std::string, MetadataValue>;

/// Writes premultiplied linear RGBA (and further channels), atomically: beside its final name, then renamed.
/// The display window is the image, the data window leaves out a blank margin. Sets the standard attributes
/// worldToCamera, worldToNDC, framesPerSecond; `metadata` holds "comments" and "kairos:*" entries. Throws
/// OutputError; nothing is left behind.
void writeExr(const std::string& path, const Image& rgba, const std::vector<ExrChannel>& channels,
              const Camera& camera, const Metadata& metadata, const ExrOptions& options);

/// Writes an 8-bit sRGB PNG of the image over black (premultiplied colour as is, opaque). Atomic; throws
/// OutputError.
void writePng(const std::string& path, const Image& rgba);

/// Reads an EXR (channels R, G, B, A, or Y; a missing A is 1; its display window, 0 outside its data window)
/// or a PNG (taken as straight sRGB) as premultiplied linear RGBA. Throws InputError.
Image readImage(const std::string& path);

/// String, int, float and double attributes of an EXR file's header. Throws InputError.
Metadata readMetadata(const std::string& path);

/// Can this output be produced? Checks the extension (.exr), the `####`/`%04d` place for the step (which a
/// single image does without) and the directory, before anything is loaded. Throws OptionError or
/// OutputError.
void checkOutputPattern(const std::string& pattern, bool singleImage = false);

/// Replaces the run of `#` (or `%04d`) in `pattern` by the step number, zero-padded to its length.
std::string framePath(const std::string& pattern, long long step);

}  // namespace kairos
