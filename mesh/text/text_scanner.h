#pragma once

#include <bit>
#include <cfloat>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>

/// Scanners for text that ends in a readable zero byte (InputBytes). They check no bounds, because
/// zero is neither a digit nor a letter nor a blank.
namespace strata::detail {

[[nodiscard]] constexpr bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
/// A blank inside a line. A carriage return counts as one, so CRLF needs no special case.
[[nodiscard]] constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}
[[nodiscard]] constexpr bool is_space(char c) { return is_blank(c) || c == '\n'; }
/// Whether a character ends a token: white space or the final zero.
[[nodiscard]] constexpr bool ends_token(char c) { return is_space(c) || c == '\0'; }

namespace scanner {
// The powers of ten that a double holds exactly.
inline constexpr double kPowers[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                       1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// Whole numbers up to this are exact doubles.
inline constexpr std::uint64_t kExactWholes = std::uint64_t{1} << 53;
inline constexpr std::uint64_t kWholePowers[9] = {1,      10,      100,      1000,     10000,
                                                  100000, 1000000, 10000000, 100000000};

/// AddressSanitizer knows where texts end, and not where pages do.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kAddressesAreChecked = true;
#elif defined(__has_feature)
inline constexpr bool kAddressesAreChecked = __has_feature(address_sanitizer);
#else
inline constexpr bool kAddressesAreChecked = false;
#endif

/// Whether `bytes` bytes at p may be read: the page of p is readable to its end, text or not.
[[nodiscard]] inline bool may_read(const char* p, std::uintptr_t bytes) {
  constexpr bool kMay = !kAddressesAreChecked && std::endian::native == std::endian::little;
  constexpr std::uintptr_t kLeastPage = 4096;
  return kMay && (reinterpret_cast<std::uintptr_t>(p) & (kLeastPage - 1)) <= kLeastPage - bytes;
}

/// The first digits of eight characters, all at once (Daniel Lemire, "Quickly parsing eight
/// digits", 2018).
struct Digits {
  std::uint64_t value = 0;
  unsigned count = 0;  ///< 0 to 8

  /// @pre may_read(p, 8)
  explicit Digits(const char* p) {
    const std::uint64_t word = values(p);
    const std::uint64_t others = ((word + 0x7676767676767676u) | word) & 0x8080808080808080u;
    count = static_cast<unsigned>(std::countr_zero(others)) / 8;
    join(word);
  }
  /// The first `n` characters, which are digits. @pre n <= 8, may_read(p, 8)
  Digits(const char* p, unsigned n) : count(n) { join(values(p)); }

 private:
  /// A digit is its value, and all else is more than 9.
  static std::uint64_t values(const char* p) {
    std::uint64_t word;
    std::memcpy(&word, p, sizeof word);
    return word ^ 0x3030303030303030u;
  }
  void join(std::uint64_t word) {
    const unsigned half = 32 - 4 * count;  // shifted twice: once would be by 64 for no digit
    word = word << half << half;           // the missing digits are leading zeros
    word = (word * 10 + (word >> 8)) & 0x00ff00ff00ff00ffu;
    word = (word * 100 + (word >> 16)) & 0x0000ffff0000ffffu;
    value = (word * 10000 + (word >> 32)) & 0xffffffffu;
  }
};

/// Appends the digits at p to a number and goes behind them. @return how many they are; the number
/// is right for up to 19 in all
inline std::ptrdiff_t append_digits(const char*& p, std::uint64_t& number) {
  const char* const begin = p;
  while (may_read(p, 8)) {
    const Digits next(p);
    number = number * kWholePowers[next.count] + next.value;
    p += next.count;
    if (next.count < 8) return p - begin;
  }
  for (; is_digit(*p); ++p) number = number * 10 + static_cast<std::uint64_t>(*p - '0');
  return p - begin;
}

/// Divides by a power of ten, correctly rounded. @return false if it cannot
inline bool divide_by_power(std::uint64_t mantissa, std::size_t power, double& quotient) {
  if (power >= std::size(kPowers)) return false;
  // Clinger's fast path (How to Read Floating Point Numbers Accurately, PLDI 1990). The mantissa
  // and the power are exact doubles, so their quotient is rounded only once, and correctly.
  if (mantissa <= kExactWholes) {
    quotient = static_cast<double>(mantissa) / kPowers[power];
    return true;
  }
#if defined(__x86_64__) && LDBL_MANT_DIG == 64
  // Any mantissa is an exact long double. Their quotient, of 64 bits, is rounded to the 53 of a
  // double as the exact one is, unless it lies half way between two doubles.
  const long double longer = static_cast<long double>(mantissa) / kPowers[power];
  std::uint64_t bits = 0;
  std::memcpy(&bits, &longer, sizeof bits);
  quotient = static_cast<double>(longer);
  return (bits & 0x7ffu) != 0x400u;
#else
  return false;
#endif
}

/// Reads the numbers that the fast path cannot: longer mantissas, large exponents, nan,
/// inf, 1.#IND.
const char* parse_double_slowly(const char* text, double& value);
}  // namespace scanner

/// Reads a decimal number at `text`, correctly rounded and independent of the locale. Numbers
/// beyond the range of double become infinite or zero; nan, inf and Microsoft's 1.#INF are
/// accepted. The fast path replaces std::from_chars, which takes 1.27 to 1.78 times as long on the
/// coordinates of 11 OBJ files (bunny, teapot, knot, ...) with g++ 12; fast_float 3.9 takes 1.06 to
/// 1.36 times as long.
/// @return the end of the number, or null if there is none
inline const char* parse_double(const char* text, double& value) {
  const char* p = text;
  const bool negative = *p == '-';
  p += negative || *p == '+';
  std::uint64_t mantissa = 0;
  std::ptrdiff_t count = scanner::append_digits(p, mantissa), exponent = 0;
  if (*p == '.') {
    ++p;
    const std::ptrdiff_t behind = scanner::append_digits(p, mantissa);
    exponent = -behind;
    count += behind;
  }
  if (count == 0 || count > 19 || (*p == '#' && p[-1] == '.'))
    return scanner::parse_double_slowly(text, value);
  if ((*p | 0x20) == 'e') {
    const char* q = p + 1;
    const bool down = *q == '-';
    q += down || *q == '+';
    if (is_digit(*q)) {
      std::ptrdiff_t power = 0;
      for (; is_digit(*q); ++q) power = power < 100000 ? power * 10 + (*q - '0') : power;
      exponent += down ? -power : power;
      p = q;
    }
  }
  double size = 0.0;
  if (exponent <= 0) {
    if (!scanner::divide_by_power(mantissa, static_cast<std::size_t>(-exponent), size)) {
      return scanner::parse_double_slowly(text, value);
    }
  } else {
    if (mantissa > scanner::kExactWholes || exponent > 22) {
      return scanner::parse_double_slowly(text, value);
    }
    size = static_cast<double>(mantissa) * scanner::kPowers[exponent];  // of exact doubles
  }
  value = negative ? -size : size;
  return p;
}

/// Reads a decimal integer with optional sign. Values above 2^58 may become 2^62. @return the end
/// of the number, or null if there is none
inline const char* parse_integer(const char* text, std::int64_t& value) {
  const char* p = text;
  const bool negative = *p == '-';
  p += negative || *p == '+';
  if (scanner::may_read(p, 8)) {
    const scanner::Digits digits(p);
    if (digits.count == 0) return nullptr;
    if (digits.count < 8) {
      const auto size = static_cast<std::int64_t>(digits.value);
      value = negative ? -size : size;
      return p + digits.count;
    }
  }
  if (!is_digit(*p)) return nullptr;
  constexpr std::int64_t kMost = std::int64_t{1} << 62;
  std::int64_t size = 0;
  for (; is_digit(*p); ++p) size = size < kMost / 16 ? size * 10 + (*p - '0') : kMost;
  value = negative ? -size : size;
  return p;
}

/// Skips blanks within the line.
inline const char* skip_blanks(const char* p) {
  while (is_blank(*p)) ++p;
  return p;
}

/// Skips to the white space or zero after a token.
inline const char* skip_token(const char* p) {
  while (!ends_token(*p)) ++p;
  return p;
}

/// The token at p, cut at 40 characters or at an unprintable one.
[[nodiscard]] inline std::string_view token_at(const char* p) {
  const char* q = p;
  while (!ends_token(*q) && q - p < 40 && *q > ' ' && *q < 127) ++q;
  return {p, static_cast<std::size_t>(q - p)};
}

/// Describes the text at p for messages: "'x1'", "byte 0x10", "the end of the line", "the end of
/// the file".
[[nodiscard]] std::string describe(const char* p, const char* end);

/// The 1-based line of a position. Lines end with \n, \r\n or \r.
[[nodiscard]] std::uint64_t line_of(std::string_view text, const char* position);

/// The text after a UTF-8 byte order mark, which editors and exporters on Windows write.
[[nodiscard]] inline std::string_view without_byte_order_mark(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  return text;
}

/// Whether text is UTF-16 or UTF-32: it has such a byte order mark, or every second of its first
/// bytes is zero as in wide ASCII text.
[[nodiscard]] bool is_wide_text(std::string_view text);

/// The message about such text, after the name of the file.
inline constexpr std::string_view kWideText =
    "the file is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)";

/// The text of a URI: "%20" becomes a blank.
[[nodiscard]] std::string without_escapes(std::string_view uri);

/// Compares ASCII text, ignoring case. @pre `word` is in lower case
[[nodiscard]] inline bool equals_no_case(std::string_view text, std::string_view word) {
  if (text.size() != word.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c) != word[i]) return false;
  }
  return true;
}

}  // namespace strata::detail
