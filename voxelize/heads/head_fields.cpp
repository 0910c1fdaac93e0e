#include "voxelize/heads/head_fields.h"

#include <charconv>
#include <cmath>

namespace strata {

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

std::vector<double> numbers_of(std::string_view text) {
  std::vector<double> list;
  for (std::size_t at = 0; at < text.size();) {
    if (text.substr(at).starts_with("none")) {
      list.insert(list.end(), 3, std::nan(""));
      at += 4;
      continue;
    }
    double value = 0.0;
    const auto [rest, error] = std::from_chars(text.data() + at, text.data() + text.size(), value);
    if (error != std::errc()) {
      ++at;
      continue;
    }
    list.push_back(value);
    at = static_cast<std::size_t>(rest - text.data());
  }
  return list;
}

}  // namespace strata
