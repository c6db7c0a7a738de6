#include "io/transfer_function_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/colour_map.h"
#include "core/error.h"
#include "core/srgb.h"
#include "io/file_bytes.h"
#include "io/paraview_colour.h"

namespace kairos {
namespace {

using nlohmann::json;
using ColourPoints = std::vector<TransferFunction::ColourPoint>;
using OpacityPoints = std::vector<TransferFunction::OpacityPoint>;

std::string readText(const std::string& path) {
  const InputFile file(path);
  constexpr uint64_t kLargest = 64 << 20;
  if (file.size() > kLargest)
    throw InputError(path, "has " + std::to_string(file.size()) + " bytes, too many for a transfer function");
  const std::vector<char> bytes = file.readAll();
  return {bytes.begin(), bytes.end()};
}

// Rows of `value r g b a`.

struct Row {
  double value, r, g, b, a;
};

[[noreturn]] void badLine(const std::string& path, size_t line, const std::string& problem) {
  throw InputError(path, "line " + std::to_string(line) + ": " + problem);
}

bool parseRow(const std::string& path, size_t line, std::string text, Row& row) {
  text.resize(std::min(text.find('#'), text.size()));
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (*end != '\0' || !std::isfinite(numbers.back()))
      badLine(path, line, "\"" + word.substr(0, 40) + "\" is not a finite number");
  }
  if (numbers.empty()) return false;
  if (numbers.size() != 5)
    badLine(path, line, std::to_string(numbers.size()) + " numbers, expected value r g b a");
  row = {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]};
  if (std::min({row.r, row.g, row.b}) < 0) badLine(path, line, "a colour below 0");
  if (row.a < 0 || row.a > 1) badLine(path, line, "an opacity outside [0, 1]");
  return true;
}

TransferFunction fromRows(const std::string& path, const std::string& text) {
  ColourPoints colours;
  OpacityPoints opacities;
  std::istringstream lines(text);
  size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    Row row{};
    if (!parseRow(path, ++number, line, row)) continue;
    if (!colours.empty() && row.value < colours.back().value)
      badLine(path, number, "the value is lower than the one before");
    colours.push_back({row.value, {row.r, row.g, row.b}});
    opacities.push_back({row.value, row.a});
  }
  if (colours.empty()) throw InputError(path, "holds no row of value r g b a");
  return {std::move(colours), std::move(opacities)};
}

// ParaView's JSON.

class ParaViewMap {
 public:
  ParaViewMap(const std::string& path, const json& object) : path_(path), object_(object) {}

  TransferFunction transferFunction() const {
    ColourPoints colours = colourPoints();
    OpacityPoints opacities = object_.contains("Points") && !object_["Points"].is_null()
                                  ? opacityPoints()
                                  : defaultOpacity(colours.front().value, colours.back().value);
    return {std::move(colours), std::move(opacities)};
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw InputError(path_, problem); }

  // An array of finite numbers in rows of `width`, sorted by the first of each row.
  std::vector<double> rows(const char* key, size_t width) const {
    const auto it = object_.find(key);
    if (it == object_.end() || !it->is_array() || it->empty() || it->size() % width != 0)
      fail(std::string(key) + ": expected an array of rows of " + std::to_string(width) + " numbers");
    std::vector<double> numbers;
    for (const json& n : *it) {
      numbers.push_back(n.is_number() ? n.get<double>() : std::nan(""));
      if (!std::isfinite(numbers.back()))
        fail(std::string(key) + "[" + std::to_string(numbers.size() - 1) + "] is not a finite number");
    }
    for (size_t i = width; i < numbers.size(); i += width)
      if (numbers[i] < numbers[i - width])
        fail(std::string(key) + "[" + std::to_string(i) + "] is lower than the value before");
    return numbers;
  }

  double number(const std::vector<double>& values, size_t i, const char* key) const {
    if (values[i] < 0 || values[i] > 1)
      fail(std::string(key) + "[" + std::to_string(i) + "] is outside [0, 1]");
    return values[i];
  }

  bool flag(const char* key) const {
    const auto it = object_.find(key);
    if (it == object_.end()) return false;
    return it->is_boolean() ? it->get<bool>() : it->is_number() && it->get<double>() != 0;
  }

  ParaViewColourSpace colourSpace() const {
    const auto it = object_.find("ColorSpace");
    if (it == object_.end()) return ParaViewColourSpace::rgb;
    const std::string name = it->is_string() ? it->get<std::string>() : it->dump();
    if (name == "RGB") return ParaViewColourSpace::rgb;
    if (name == "HSV") return flag("HSVWrap") ? ParaViewColourSpace::hsvWrapped : ParaViewColourSpace::hsv;
    if (name == "Lab" || name == "CIELAB") return ParaViewColourSpace::lab;
    if (name == "Diverging") return ParaViewColourSpace::diverging;
    if (name == "Step") return ParaViewColourSpace::step;
    fail("ColorSpace: \"" + name.substr(0, 40) + "\", expected RGB, Lab, HSV, Diverging or Step");
  }

  // Enough straight pieces per interval to follow the curve, without letting a map of many points explode.
  static int pieces(size_t intervals) {
    return 2 * int(std::clamp<size_t>(4096 / std::max<size_t>(intervals, 1), 4,
                                      32));  // even: the middle may be a kink
  }

  static Vec3d linear(const DisplayColour& c) {
    return {linearFromSrgb(c[0]), linearFromSrgb(c[1]), linearFromSrgb(c[2])};
  }

  ColourPoints colourPoints() const {
    if (flag("UseLogScale")) fail("UseLogScale: logarithmic maps are not supported");
    const ParaViewColourSpace space = colourSpace();
    const std::vector<double> v = rows("RGBPoints", 4);
    const auto colour = [&](size_t i) {
      return DisplayColour{number(v, i + 1, "RGBPoints"), number(v, i + 2, "RGBPoints"),
                           number(v, i + 3, "RGBPoints")};
    };
    const int n = pieces(v.size() / 4 - 1);
    ColourPoints points{{v[0], linear(colour(0))}};
    for (size_t i = 4; i < v.size(); i += 4)
      addColours(points, space, v[i - 4], v[i], colour(i - 4), colour(i), n);
    return points;
  }

  static void addColours(ColourPoints& points, ParaViewColourSpace space, double from, double to,
                         const DisplayColour& a, const DisplayColour& b, int n) {
    if (space == ParaViewColourSpace::step) points.push_back({from, linear(b)});
    const bool curved = to > from && space != ParaViewColourSpace::step && a != b;
    for (int k = 1; curved && k < n; ++k) {
      const double s = double(k) / n;
      points.push_back({from + (to - from) * s, linear(interpolateParaViewColour(space, a, b, s))});
    }
    points.push_back({to, linear(b)});
  }

  OpacityPoints opacityPoints() const {
    const std::vector<double> v = rows("Points", 4);
    const int n = 4 * pieces(v.size() / 4 - 1);
    OpacityPoints points{{v[0], number(v, 1, "Points")}};
    for (size_t i = 4; i < v.size(); i += 4) {
      const double midpoint = number(v, i - 2, "Points"), sharpness = number(v, i - 1, "Points");
      addOpacities(points, v[i - 4], v[i], number(v, i - 3, "Points"), number(v, i + 1, "Points"), midpoint,
                   sharpness, n);
    }
    return points;
  }

  static void addOpacities(OpacityPoints& points, double from, double to, double a, double b, double midpoint,
                           double sharpness, int n) {
    const double middle = from + (to - from) * std::clamp(midpoint, 0.00001, 0.99999);
    if (to > from && a != b) {
      if (sharpness > 0.99) {
        points.insert(points.end(), {{middle, a}, {middle, b}});
      } else if (sharpness < 0.01) {
        points.push_back({middle, (a + b) / 2});
      } else {
        // Half of the pieces on either side of the midpoint, where the curve is steepest.
        for (int k = 1; k < n; ++k) {
          const double t = double(k) / n;
          const double x = t < 0.5 ? from + (middle - from) * 2 * t : middle + (to - middle) * (2 * t - 1);
          points.push_back(
              {x, interpolateParaViewOpacity(a, b, midpoint, sharpness, (x - from) / (to - from))});
        }
      }
    }
    points.push_back({to, b});
  }

  static OpacityPoints defaultOpacity(double lo, double hi) {
    const TransferFunction ramp = builtInTransferFunction(colourMapNames().front());
    OpacityPoints points;
    const double from = ramp.opacityPoints().front().value, width = ramp.opacityPoints().back().value - from;
    for (const auto& p : ramp.opacityPoints())
      points.push_back({lo + (hi - lo) * (p.value - from) / width, p.opacity});
    return points;
  }

  const std::string& path_;
  const json& object_;
};

TransferFunction fromJson(const std::string& path, const std::string& text) {
  const json document = json::parse(text);
  const json* map = document.is_object() ? &document : nullptr;
  if (document.is_array())
    for (const json& entry : document)
      if (!map && entry.is_object() && entry.contains("RGBPoints")) map = &entry;
  if (!map || !map->contains("RGBPoints")) throw InputError(path, "holds no colour map with RGBPoints");
  return ParaViewMap(path, *map).transferFunction();
}

}  // namespace

TransferFunction readTransferFunction(const std::string& path) {
  const std::string text = readText(path);
  const size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  try {
    if (first != std::string::npos && (text[first] == '[' || text[first] == '{'))
      return fromJson(path, text.substr(first));
    return fromRows(path, text);
  } catch (const json::exception& e) {
    throw InputError(path, std::string("is not valid JSON: ") + e.what());
  } catch (const OptionError& e) {
    throw InputError(path, e.what());
  }
}

}  // namespace kairos
