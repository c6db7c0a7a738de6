#include "core/colour_map.h"

#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "core/colour_map_data.h"
#include "core/error.h"

namespace kairos {
namespace {

struct BuiltInMap {
  const char* name;
  std::span<const ColourMapKnot> knots;
};

// The default first: inferno's glow reads best over black, and its luminance rises monotonically.
constexpr BuiltInMap kMaps[] = {{"inferno", kInferno},   {"magma", kMagma},     {"plasma", kPlasma},
                                {"viridis", kViridis},   {"cividis", kCividis}, {"turbo", kTurbo},
                                {"coolwarm", kCoolwarm}, {"gray", kGray}};

std::span<const ColourMapKnot> knotsOf(const std::string& name) {
  for (const BuiltInMap& map : kMaps)
    if (name == map.name || (name == "grey" && std::string_view(map.name) == "gray")) return map.knots;
  std::string known;
  for (const BuiltInMap& map : kMaps) known += (known.empty() ? "" : ", ") + std::string(map.name);
  throw OptionError("--tf", "found \"" + name + "\", expected a file or one of " + known);
}

// Transparent up to 4 % of the domain, so that background and faint haze are skipped; then a power curve that
// starts with slope zero, hence without a visible edge, up to a quarter per unit distance.
std::vector<TransferFunction::OpacityPoint> defaultOpacity() {
  constexpr double kTransparent = 0.04, kExponent = 1.25, kTop = 0.25;
  constexpr int kSegments = 32;
  std::vector<TransferFunction::OpacityPoint> points{{0.0, 0.0}};
  for (int i = 0; i <= kSegments; ++i) {
    const double f = double(i) / kSegments;
    points.push_back({kTransparent + (1.0 - kTransparent) * f, kTop * std::pow(f, kExponent)});
  }
  return points;
}

}  // namespace

const std::vector<std::string>& colourMapNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> n;
    for (const BuiltInMap& map : kMaps) n.emplace_back(map.name);
    return n;
  }();
  return names;
}

TransferFunction builtInTransferFunction(const std::string& name) {
  std::vector<TransferFunction::ColourPoint> colours;
  for (const ColourMapKnot& k : knotsOf(name)) colours.push_back({k.position / 255.0, Vec3d{k.r, k.g, k.b}});
  return {std::move(colours), defaultOpacity()};
}

}  // namespace kairos
