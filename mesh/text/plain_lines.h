#pragma once

#include <glm/vec3.hpp>

#include <bit>
#include <cstdint>

#include "mesh/text/text_scanner.h"
#ifdef __SSE2__
#include <emmintrin.h>
#endif

// Lines as most files of a million triangles have them: three numbers with one blank between two.
// All that is not so plain is left to the caller, who reads it number by number.

namespace strata::detail {

/// Behind a line end, before which blanks may stand; null if there is none.
inline const char* behind_line(const char* p) {
  while (*p == ' ' || *p == '\r') ++p;
  return *p == '\n' ? p + 1 : nullptr;
}

namespace scanner {

#ifdef __SSE2__
/// The characters of a line that are no digits, as bits. Where the numbers of a line end is known
/// before any of them is read, so that the processor reads them side by side.
template <int kSixteens>
class Separators {
 public:
  static constexpr std::uintptr_t kBytes = 16 * kSixteens;

  /// @pre may_read(p, kBytes)
  explicit Separators(const char* p) {
    for (int i = 0; i < kSixteens; ++i) {
      const __m128i text = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + 16 * i));
      const __m128i value = _mm_sub_epi8(text, _mm_set1_epi8('0'));
      const __m128i digit = _mm_cmpeq_epi8(value, _mm_min_epu8(value, _mm_set1_epi8(9)));
      const auto digits = static_cast<std::uint64_t>(_mm_movemask_epi8(digit));
      others_ |= (digits ^ 0xffffu) << (16 * i);
    }
  }
  /// The place of the next one; 64 behind the last.
  unsigned next() {
    const auto place = static_cast<unsigned>(std::countr_zero(others_));
    others_ &= others_ - 1;
    return place;
  }

 private:
  std::uint64_t others_ = 0;
};
#endif

/// Reads an unsigned number below 10^7. @return its end, or null
inline const char* plain_index(const char* p, std::uint32_t& value) {
  std::uint64_t number = 0;
  const std::ptrdiff_t count = append_digits(p, number);
  if (count < 1 || count > 7) return nullptr;
  value = static_cast<std::uint32_t>(number);
  return p;
}

}  // namespace scanner

/// Reads the rest of a line that holds three numbers. @return the next line; null for all else
inline const char* plain_vertex(const char* p, glm::dvec3& position) {
#ifdef __SSE2__
  using Separators = scanner::Separators<4>;
  if (scanner::may_read(p, Separators::kBytes + 8)) {
    Separators separators(p);
    unsigned begin = 0;
    bool plain = true;
    for (int i = 0; i < 3 && plain; ++i) {
      const bool negative = p[begin] == '-';
      if (negative) begin = separators.next() + 1;  // neighbours have equal signs, mostly
      const unsigned point = separators.next(), stop = separators.next();
      const unsigned before = point - begin, behind = stop - point - 1;
      // 64 is where the last separator is not.
      plain = stop < Separators::kBytes && p[point] == '.' && before - 1 < 7 && behind <= 8 &&
              p[stop] == (i < 2 ? ' ' : '\n');
      if (!plain) break;
      const std::uint64_t whole = scanner::Digits(p + begin, before).value;
      const std::uint64_t part = scanner::Digits(p + point + 1, behind).value;
      // Below 10^15: exact, as parse_double() has it.
      const auto mantissa = static_cast<double>(whole * scanner::kWholePowers[behind] + part);
      const double size = mantissa / scanner::kPowers[behind];
      position[i] = negative ? -size : size;
      begin = stop + 1;
    }
    if (plain) return p + begin;
  }
#endif
  for (int i = 0; i < 3; ++i) {
    while (*p == ' ') ++p;
    p = parse_double(p, position[i]);
    if (p == nullptr || (i < 2 && *p != ' ')) return nullptr;
  }
  return behind_line(p);
}

/// Reads the rest of a line that holds three unsigned numbers below 10^7. @return the next line;
/// null for all else
inline const char* plain_triangle(const char* p, glm::uvec3& corners) {
#ifdef __SSE2__
  using Separators = scanner::Separators<2>;
  if (scanner::may_read(p, Separators::kBytes)) {
    Separators separators(p);
    const unsigned first = separators.next(), second = separators.next(), third = separators.next();
    if (third < Separators::kBytes && p[first] == ' ' && p[second] == ' ' && p[third] == '\n') {
      const unsigned counts[] = {first, second - first - 1, third - second - 1};
      if (counts[0] - 1 < 7 && counts[1] - 1 < 7 && counts[2] - 1 < 7) {
        const auto value = [](const char* at, unsigned count) {
          return static_cast<std::uint32_t>(scanner::Digits(at, count).value);
        };
        corners = {value(p, counts[0]), value(p + first + 1, counts[1]),
                   value(p + second + 1, counts[2])};
        return p + third + 1;
      }
    }
  }
#endif
  for (int i = 0; i < 3; ++i) {
    while (*p == ' ') ++p;
    p = scanner::plain_index(p, corners[i]);
    if (p == nullptr || (i < 2 && *p != ' ')) return nullptr;
  }
  return behind_line(p);
}

}  // namespace strata::detail
