// Uses the installed package's file formats: writes an image and reads it back.
#include <cmath>
#include <cstdio>

#include "io/image_file.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  kairos::Image image(8, 4, 4);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i % 5) / 4;
  kairos::ExrOptions options;
  options.half = false;
  kairos::writeExr(argv[1], image, {}, kairos::Camera{}, {}, options);
  const bool same = kairos::readImage(argv[1]) == image;
  std::printf("%s: %s\n", argv[1], same ? "read back as written" : "differs from what was written");
  return same ? 0 : 1;
}
