#pragma once

#include <string>
#include <string_view>

namespace strata {

/// The text as content or attribute of XML and HTML.
[[nodiscard]] inline std::string escape_markup(std::string_view text) {
  std::string out;
  for (const char letter : text) {
    switch (letter) {
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
        out += letter;
    }
  }
  return out;
}

}  // namespace strata
