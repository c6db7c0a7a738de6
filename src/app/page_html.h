// Pieces of an HTML page. Every number names its entry in the report's JSON, so that nothing on the page
// stands there alone.
#pragma once

#include <string>
#include <vector>

namespace kairos {

/// `value` with `decimals` behind the point and the JSON pointer it comes from; infinite and missing numbers
/// are "∞" and "–".
std::string numberHtml(double value, int decimals, const std::string& pointer);
/// A fraction as a percentage.
std::string percentHtml(double fraction, int decimals, const std::string& pointer);
/// Three significant digits, for errors.
std::string smallNumberHtml(double value, const std::string& pointer);

/// A table whose first column names the rows.
class HtmlTable {
 public:
  explicit HtmlTable(const std::vector<std::string>& headers);
  void row(const std::string& name, const std::string& colour = "");
  void text(const std::string& text);
  /// A cell of a number made by the functions above.
  void number(const std::string& html, bool best = false);
  std::string finished() &&;

 private:
  std::string html_;
  bool inRow_ = false;
};

/// A picture with its caption.
std::string figureHtml(const std::string& content, const std::string& caption = "");
/// A table that opens on demand.
std::string numbersHtml(HtmlTable table);
/// The bytes as a data URI.
std::string dataUri(const std::string& mediaType, const std::string& bytes);

}  // namespace kairos
