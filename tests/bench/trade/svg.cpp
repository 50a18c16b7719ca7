#include "tests/bench/trade/svg.h"

#include <charconv>
#include <cmath>

namespace kiln::trade {

std::string escape_xml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

std::string element(const std::string& name, const Attributes& attributes, const std::string& content) {
  std::string out = "<" + name;
  for (const auto& [key, value] : attributes) out += " " + key + "=\"" + escape_xml(value) + "\"";
  return out + (content.empty() ? "/>" : ">" + content + "</" + name + ">");
}

std::string coordinate(double x) {
  char out[32];
  const double rounded = std::round(100 * x) / 100 + 0.0;  // never "-0"
  return {out, std::to_chars(out, out + sizeof out, rounded).ptr};
}

}  // namespace kiln::trade
