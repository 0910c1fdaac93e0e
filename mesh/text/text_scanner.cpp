#include "mesh/text/text_scanner.h"

#include <fmt/core.h>

namespace strata::detail {

const char* scanner::parse_double_slowly(const char* text, double& value) {
  const char* begin = text + (*text == '+');
  // from_chars accepts no plus sign, and here no minus may follow one.
  if (begin != text && *begin == '-') return nullptr;
  const char* end = begin + (*begin == '-');
  while (!ends_token(*end) && *end != ',' && *end != ';' && *end != '/') ++end;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc::invalid_argument) return nullptr;
  if (error == std::errc::result_out_of_range) {
    // Is the number too large or too small? A decimal with exponent e and n digits before the point
    // is about 10^(e + n). Only the sign of e + n matters this far from 1.
    const bool negative = *begin == '-';
    const char* p = begin + negative;
    std::int64_t magnitude = 0;
    bool significant = false;
    for (; is_digit(*p); ++p) {
      significant = significant || *p != '0';
      magnitude += significant;
    }
    if (*p == '.') {
      for (++p; is_digit(*p); ++p) {
        significant = significant || *p != '0';
        magnitude -= !significant;
      }
    }
    std::int64_t exponent = 0;
    if ((*p | 0x20) == 'e' && parse_integer(p + 1, exponent)) magnitude += exponent;
    value = magnitude > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    if (negative) value = -value;
  }
  if (*stop == '#' && stop[-1] == '.') {  // 1.#INF, -1.#IND, 1.#QNAN of old Microsoft runtimes
    value = std::numeric_limits<double>::quiet_NaN();
    return skip_token(stop);
  }
  return stop;
}

std::string describe(const char* p, const char* end) {
  while (p < end && is_blank(*p)) ++p;
  if (p >= end) return "the end of the file";
  if (*p == '\n') return "the end of the line";
  const std::string_view token = token_at(p);
  if (!token.empty()) return fmt::format("'{}'", token);
  return fmt::format("byte {:#04x}", static_cast<unsigned>(static_cast<unsigned char>(*p)));
}

bool is_wide_text(std::string_view text) {
  using namespace std::string_view_literals;
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) return true;
  if (text.starts_with("\0\0\xfe\xff"sv)) return true;
  constexpr std::size_t kLooks = 16;
  if (text.size() < kLooks || (text[0] == '\0') == (text[1] == '\0')) return false;
  const std::size_t zero = text[0] == '\0' ? 0 : 1;  // big endian : little endian
  for (std::size_t i = 0; i < kLooks; ++i) {
    const char c = text[i];
    if (i % 2 == zero ? c != '\0' : !(is_space(c) || (c >= ' ' && c <= '~'))) return false;
  }
  return true;
}

std::uint64_t line_of(std::string_view text, const char* position) {
  std::uint64_t line = 1;
  for (const char* p = text.data(); p < position; ++p) {
    line += *p == '\n' || (*p == '\r' && p[1] != '\n');
  }
  return line;
}

std::string without_escapes(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    const char* const digits = uri.data() + i + 1;
    if (uri[i] == '%' && i + 2 < uri.size() &&
        std::from_chars(digits, digits + 2, value, 16).ptr == digits + 2) {
      text += static_cast<char>(value);
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

}  // namespace strata::detail
