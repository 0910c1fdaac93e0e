#pragma once

#include <algorithm>
#include <string>
#include <string_view>

// Small and capital letters of ASCII, whatever the locale is.

namespace strata {

[[nodiscard]] constexpr char lower_case(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}
[[nodiscard]] inline std::string lower_case(std::string text) {
  for (char& letter : text) letter = lower_case(letter);
  return text;
}
/// Whether two words are the same but for small and capital letters.
[[nodiscard]] constexpr bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower_case(x) == lower_case(y); });
}

}  // namespace strata
