// The pixels of an EXR file: chunks of scanlines, uncompressed or as OpenEXR's ZIP stores them (file layout
// and preprocessing in OpenEXR's "File Layout" document and ImfZip.cpp). Several times quicker than the
// library, whose zlib takes most of the time of writing a sparse animation.
#pragma once

#include <ImfIO.h>

#include <cstddef>
#include <string>
#include <vector>

#include "core/image.h"

namespace kairos {

/// A channel of an image of floats, stored as halves or as floats. Strides are in floats.
struct ExrPlane {
  std::string name;
  const float* first;  // of pixel (0, 0)
  size_t pixelStride, rowStride;
  bool half;

  const float* at(int x, int y) const { return first + size_t(y) * rowStride + size_t(x) * pixelStride; }
};

/// Pixels [x0, x1] x [y0, y1] of an image.
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  int width() const { return x1 - x0 + 1; }
};

/// The smallest window outside which all of these images of one size are 0; one pixel where they are blank.
PixelWindow contentWindow(const std::vector<const Image*>& images);

/// Writes the table of chunks and the chunks at the stream's position, behind the header. `planes` are in the
/// order of their names. Chunks hold `rowsPerChunk` rows (16 with ZIP, else 1).
void writeScanlines(Imf::OStream& out, const std::vector<ExrPlane>& planes, const PixelWindow& window,
                    int rowsPerChunk, bool compressed);

}  // namespace kairos
