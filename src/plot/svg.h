// SVG elements as text.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace kairos::plot {

/// For text and attribute values of XML and HTML.
std::string escaped(std::string_view text);

/// A coordinate in pixels with at most two decimals.
std::string coordinate(double value);

/// An attribute's value: text, or a coordinate.
class Value {
 public:
  Value(const char* text) : text_(text) {}
  Value(std::string text) : text_(std::move(text)) {}
  Value(double number) : text_(coordinate(number)) {}
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

using Attributes = std::initializer_list<std::pair<const char*, Value>>;

/// An SVG picture, put together element by element. Attribute values and texts are escaped here.
class Svg {
 public:
  /// Its place decides the size, within limits that keep texts legible. `description` is what a screen
  /// reader says.
  Svg(double width, double height, const std::string& description);

  /// An element without children, or one that shows `title` when pointed at.
  void element(const char* name, Attributes attributes, const std::string& title = "");
  void text(const std::string& text, Attributes attributes);
  void openGroup(Attributes attributes);
  void closeGroup() { body_ += "</g>"; }

  /// The whole picture.
  std::string finished() && { return std::move(body_) + "</svg>"; }

 private:
  void open(const char* name, Attributes attributes);

  std::string body_;
};

}  // namespace kairos::plot
