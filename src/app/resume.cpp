#include "app/resume.h"

#include <filesystem>
#include <sstream>

#include "core/error.h"
#include "io/file_bytes.h"
#include "io/image_file.h"

namespace kairos {
namespace {

void append(std::ostream& out, const Vec3d& v) {
  out << v.x << ',' << v.y << ',' << v.z << ' ';
}

void append(std::ostream& out, const Camera& c) {
  append(out, c.eye);
  append(out, c.target);
  append(out, c.up);
  out << int(c.projection) << ' '
      << (c.projection == Camera::Projection::perspective ? c.verticalFovDegrees : c.imageHeight) << '\n';
}

void append(std::ostream& out, const TransferFunction& tf) {
  for (const auto& p : tf.colourPoints()) {
    out << p.value << ':';
    append(out, p.colour);
  }
  for (const auto& p : tf.opacityPoints()) out << p.value << ':' << p.opacity << ' ';
  out << '\n';
}

void append(std::ostream& out, const Lattice& lattice) {
  for (const Vec3d& column : lattice.worldFromIndex.column) append(out, column);
  append(out, lattice.worldFromIndex.translation);
  append(out, Vec3d(lattice.domain.lo));
  append(out, Vec3d(lattice.domain.hi));
  out << int(lattice.type) << ' ' << lattice.background << ' ' << lattice.dense << '\n';
}

bool readable(const std::string& path, const RenderSettings& settings) {
  const Image image = readImage(path);
  return image.width == settings.width && image.height == settings.height;
}

}  // namespace

uint64_t settingsFingerprint(const RenderSettings& s, const Lattice& lattice, const std::string& further) {
  std::ostringstream out;
  out << std::hexfloat << "kairos " << KAIROS_VERSION << '\n';
  append(out, s.camera);
  append(out, s.transferFunction);
  append(out, lattice);
  out << s.width << 'x' << s.height << ' ' << s.range.lo << ' ' << s.range.hi << ' ' << s.unitDistance << ' '
      << s.step << ' ' << s.preintegrated << ' ' << s.error << ' ' << int(s.filter) << ' ' << int(s.mode)
      << ' ' << s.shade << ' ' << s.depth << ' ' << s.terminate << ' ' << int(s.isa) << ' '
      << int(s.precision) << '\n';
  if (s.clipBox) {
    append(out, s.clipBox->lo);
    append(out, s.clipBox->hi);
  }
  out << further;
  return xxh64(out.str());
}

std::string frameFingerprint(uint64_t settings, uint64_t stepIdentity) {
  return hexOf(xxh64(hexOf(settings) + hexOf(stepIdentity)));
}

bool frameStands(const std::string& path, const std::string& png, const RenderSettings& settings,
                 const std::string& fingerprint) {
  if (!std::filesystem::is_regular_file(path) || (!png.empty() && !std::filesystem::is_regular_file(png)))
    return false;
  try {
    const Metadata metadata = readMetadata(path);
    const auto entry = metadata.find("kairos:settings");
    if (entry == metadata.end() || !std::holds_alternative<std::string>(entry->second) ||
        std::get<std::string>(entry->second) != fingerprint)
      return false;
    return readable(path, settings) && (png.empty() || readable(png, settings));
  } catch (const InputError&) {
    return false;  // damaged: rendered anew
  }
}

}  // namespace kairos
