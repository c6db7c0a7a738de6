#include "app/page_html.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "app/text_format.h"
#include "plot/svg.h"

namespace kairos {
namespace {

std::string sourced(const std::string& text, const std::string& pointer) {
  return "<span data-json=\"" + plot::escaped(pointer) + "\">" + text + "</span>";
}

std::string notFinite(double value) {
  return std::isnan(value) ? "–" : value > 0 ? "∞" : "-∞";
}

}  // namespace

std::string numberHtml(double value, int decimals, const std::string& pointer) {
  return sourced(std::isfinite(value) ? formatted("%.*f", decimals, value) : notFinite(value), pointer);
}

std::string percentHtml(double fraction, int decimals, const std::string& pointer) {
  return sourced(
      std::isfinite(fraction) ? formatted("%.*f %%", decimals, 100 * fraction) : notFinite(fraction),
      pointer);
}

std::string smallNumberHtml(double value, const std::string& pointer) {
  return sourced(std::isfinite(value) ? formatted("%.3g", value) : notFinite(value), pointer);
}

HtmlTable::HtmlTable(const std::vector<std::string>& headers) {
  html_ = "<div class=\"scroll\"><table><thead><tr>";
  for (size_t i = 0; i < headers.size(); ++i)
    html_ += std::string(i ? "<th class=\"n\">" : "<th>") + plot::escaped(headers[i]) + "</th>";
  html_ += "</tr></thead><tbody>";
}

void HtmlTable::row(const std::string& name, const std::string& colour) {
  if (inRow_) html_ += "</tr>";
  inRow_ = true;
  html_ += "<tr><th>";
  if (!colour.empty()) html_ += "<i class=\"dot\" style=\"color:" + plot::escaped(colour) + "\"></i>";
  html_ += plot::escaped(name) + "</th>";
}

void HtmlTable::text(const std::string& text) {
  html_ += "<td class=\"n\">" + plot::escaped(text) + "</td>";
}

void HtmlTable::number(const std::string& html, bool best) {
  html_ += std::string(best ? "<td class=\"n best\">" : "<td class=\"n\">") + html + "</td>";
}

std::string HtmlTable::finished() && {
  return std::move(html_) + (inRow_ ? "</tr>" : "") + "</tbody></table></div>";
}

std::string figureHtml(const std::string& content, const std::string& caption) {
  return "<figure>" + content + (caption.empty() ? "" : "<figcaption>" + caption + "</figcaption>") +
         "</figure>";
}

std::string numbersHtml(HtmlTable table) {
  return "<details><summary>Numbers</summary>" + std::move(table).finished() + "</details>";
}

std::string dataUri(const std::string& mediaType, const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:" + mediaType + ";base64,";
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace kairos
