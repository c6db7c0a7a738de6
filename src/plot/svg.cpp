#include "plot/svg.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace kairos::plot {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string coordinate(double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.2f", std::isfinite(value) ? value : 0.0);
  std::string text = buffer.data();
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

Svg::Svg(double width, double height, const std::string& description) {
  constexpr double kSmallest = 0.58, kLargest = 1.15;
  body_ = "<svg viewBox=\"0 0 " + coordinate(width) + " " + coordinate(height) +
          "\" style=\"min-width:" + coordinate(kSmallest * width) +
          "px;max-width:" + coordinate(kLargest * width) + "px\" role=\"img\" aria-label=\"" +
          escaped(description) + "\">";
}

void Svg::open(const char* name, Attributes attributes) {
  body_ += std::string("<") + name;
  for (const auto& [key, value] : attributes)
    body_ += std::string(" ") + key + "=\"" + escaped(value.text()) + "\"";
}

void Svg::element(const char* name, Attributes attributes, const std::string& title) {
  open(name, attributes);
  if (title.empty()) {
    body_ += "/>";
    return;
  }
  body_ += "><title>" + escaped(title) + "</title></" + name + ">";
}

void Svg::text(const std::string& text, Attributes attributes) {
  open("text", attributes);
  body_ += ">" + escaped(text) + "</text>";
}

void Svg::openGroup(Attributes attributes) {
  open("g", attributes);
  body_ += ">";
}

}  // namespace kairos::plot
