// Images through OpenImageIO: all reading, and PNG.
#include "io/image_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/srgb.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace kairos {
namespace {

std::unique_ptr<OIIO::ImageInput> openImage(const std::string& path) {
  [[maybe_unused]] const InputFile exists(path);  // a clearer message than OpenImageIO's
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // sRGB has to be decoded before premultiplying
  auto input = OIIO::ImageInput::open(path, &config);
  if (!input) {
    const std::string problem = OIIO::geterror();
    throw InputError(path, "is no image that can be read" + (problem.empty() ? "" : ": " + problem));
  }
  return input;
}

int channelNamed(const OIIO::ImageSpec& spec, const char* name) {
  for (int c = 0; c < spec.nchannels; ++c)
    if (spec.channelnames[size_t(c)] == name) return c;
  return -1;
}

// The channels that hold R, G, B and A; grey counts thrice, and A may be missing (-1).
std::array<int, 4> colourChannels(const std::string& path, const OIIO::ImageSpec& spec) {
  const int r = channelNamed(spec, "R"), g = channelNamed(spec, "G"), b = channelNamed(spec, "B");
  const int grey = channelNamed(spec, "Y"), alpha = channelNamed(spec, "A");
  if (r >= 0 && g >= 0 && b >= 0) return {r, g, b, alpha};
  if (grey >= 0) return {grey, grey, grey, alpha};
  if (spec.nchannels == 1) return {0, 0, 0, -1};
  throw InputError(path, "has no channels R, G, B among its " + std::to_string(spec.nchannels));
}

bool isIntegerFormat(const OIIO::TypeDesc& format) {
  return !format.is_floating_point();
}

// Integer formats hold unassociated sRGB.
void linearise(float* rgba) {
  for (int c = 0; c < 3; ++c) rgba[c] = float(linearFromSrgb(rgba[c]) * rgba[3]);
}

}  // namespace

Image readImage(const std::string& path) {
  const auto input = openImage(path);
  const OIIO::ImageSpec spec = input->spec();
  constexpr int kLargest = 1 << 16;
  if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || spec.deep || spec.width > kLargest ||
      spec.height > kLargest)
    throw InputError(path, "is not a flat image of at most 65536 x 65536 pixels");
  const auto from = colourChannels(path, spec);
  const auto channels = size_t(spec.nchannels), pixels = size_t(spec.width) * size_t(spec.height);
  std::vector<float> data;
  try {
    data.resize(pixels * channels);
    if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, data.data()))
      throw InputError(path, "cannot be read: " + input->geterror());
  } catch (const std::bad_alloc&) {
    throw InputError(path, "needs more memory than there is");
  }
  Image image(spec.width, spec.height, 4);
  for (size_t p = 0; p < pixels; ++p) {
    float* out = image.data.data() + 4 * p;
    for (size_t c = 0; c < 4; ++c) out[c] = from[c] < 0 ? 1.0f : data[p * channels + size_t(from[c])];
    if (isIntegerFormat(spec.format)) linearise(out);
  }
  return image;
}

Metadata readMetadata(const std::string& path) {
  const auto input = openImage(path);
  Metadata metadata;
  for (const OIIO::ParamValue& attribute : input->spec().extra_attribs) {
    const std::string name = attribute.name().string();
    const OIIO::TypeDesc type = attribute.type();
    if (type == OIIO::TypeDesc::STRING)
      metadata[name] = attribute.get_string();
    else if (type == OIIO::TypeDesc::INT)
      metadata[name] = attribute.get_int();
    else if (type == OIIO::TypeDesc::FLOAT)
      metadata[name] = attribute.get_float();
    else if (type == OIIO::TypeDesc::DOUBLE)
      metadata[name] = *static_cast<const double*>(attribute.data());
  }
  return metadata;
}

void writePng(const std::string& path, const Image& rgba) {
  if (rgba.width <= 0 || rgba.height <= 0 || rgba.channels < 3)
    throw OutputError(path, "an image of " + std::to_string(rgba.width) + " x " +
                                std::to_string(rgba.height) + " x " + std::to_string(rgba.channels) +
                                " cannot be written as PNG");
  std::vector<unsigned char> pixels;
  pixels.reserve(size_t(rgba.width) * size_t(rgba.height) * 3);
  for (int y = 0; y < rgba.height; ++y)
    for (int x = 0; x < rgba.width; ++x)
      for (int c = 0; c < 3; ++c)
        pixels.push_back(
            static_cast<unsigned char>(std::lround(255 * srgbFromLinear(displayed(rgba.pixel(x, y)[c])))));
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput proxy(bytes);
  const auto output = OIIO::ImageOutput::create("png");
  OIIO::ImageSpec spec(rgba.width, rgba.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (!output || !output->set_ioproxy(&proxy) || !output->open(path, spec) ||
      !output->write_image(OIIO::TypeDesc::UINT8, pixels.data()) || !output->close())
    throw OutputError(path, "cannot be encoded as PNG: " + (output ? output->geterror() : OIIO::geterror()));
  writeFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace kairos
