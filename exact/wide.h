#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <compare>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace strata::exact {

__extension__ using Int128 = __int128;            // not ISO C++: -Wpedantic
__extension__ using UInt128 = unsigned __int128;  // not ISO C++: -Wpedantic

/// The compiler's own integers that a Wide takes.
template <class T>
concept Narrow = std::signed_integral<T> || std::same_as<T, Int128>;

namespace wide_internal {

/// Calls work(0) to work(kCount - 1), each with a constant: GCC 12 keeps words that a loop indexes
/// in memory, which takes twice the time.
template <int kCount, class Work>
[[gnu::always_inline]] constexpr void repeat(const Work& work) {
  [&]<int... kIndex>(std::integer_sequence<int, kIndex...>) {
    (work(std::integral_constant<int, kIndex>()), ...);
  }
  (std::make_integer_sequence<int, kCount>());
}

}  // namespace wide_internal

/// A signed integer of 64 * kWords bits in two's complement. Nothing is allocated. Sums,
/// differences and products wrap around as the compiler's unsigned integers do; a caller states in
/// a comment why its numbers fit, and tests/exact/bit_widths_test.cpp holds it to that.
template <int kWords>
struct Wide {
  static constexpr int kBits = 64 * kWords;

  std::uint64_t word[kWords];  ///< least first

  constexpr Wide() : word{} {}

  template <Narrow T>
  constexpr Wide(T value) {  // NOLINT(google-explicit-constructor): every value fits but Int128
    static_assert(sizeof(T) <= 8 * kWords);
    word[0] = static_cast<std::uint64_t>(value);
    const std::uint64_t fill = value < 0 ? ~std::uint64_t{0} : 0;
    wide_internal::repeat<kWords - 1>([&](auto i) { word[i + 1] = fill; });
    if constexpr (sizeof(T) == 16) word[1] = static_cast<std::uint64_t>(value >> 64);
  }

  /// Widens, or keeps the low words. @pre the value fits
  template <int kOther>
  explicit(kOther > kWords) constexpr Wide(const Wide<kOther>& other) {
    const std::uint64_t fill = other.negative() ? ~std::uint64_t{0} : 0;
    wide_internal::repeat<kWords>([&](auto i) {
      if constexpr (i < kOther) {
        word[i] = other.word[i];
      } else {
        word[i] = fill;
      }
    });
    if constexpr (kOther > kWords) assert(Wide<kOther>(*this) == other);
  }

  constexpr bool negative() const { return static_cast<std::int64_t>(word[kWords - 1]) < 0; }

  constexpr Wide& operator+=(const Wide& other) {
    UInt128 sum = 0;
    wide_internal::repeat<kWords>([&](auto i) {
      sum += UInt128{word[i]} + other.word[i];
      word[i] = static_cast<std::uint64_t>(sum);
      sum >>= 64;
    });
    return *this;
  }

  constexpr Wide& operator-=(const Wide& other) {
    UInt128 sum = 1;
    wide_internal::repeat<kWords>([&](auto i) {
      sum += UInt128{word[i]} + ~other.word[i];
      word[i] = static_cast<std::uint64_t>(sum);
      sum >>= 64;
    });
    return *this;
  }

  /// Multiplies by 2^count. @pre 0 <= count < kBits
  constexpr Wide& operator<<=(int count) {
    assert(count >= 0 && count < kBits);
    const int words = count / 64, bits = count % 64;
    for (int i = kWords - 1; i >= 0; --i) {
      const std::uint64_t high = i >= words ? word[i - words] : 0;
      const std::uint64_t low = i > words ? word[i - words - 1] : 0;
      word[i] = bits == 0 ? high : high << bits | low >> (64 - bits);
    }
    return *this;
  }

  /// floor(this / 2^count). @pre 0 <= count < kBits
  constexpr Wide& operator>>=(int count) {
    assert(count >= 0 && count < kBits);
    const int words = count / 64, bits = count % 64;
    const std::uint64_t fill = negative() ? ~std::uint64_t{0} : 0;
    for (int i = 0; i < kWords; ++i) {
      const std::uint64_t low = i + words < kWords ? word[i + words] : fill;
      const std::uint64_t high = i + words + 1 < kWords ? word[i + words + 1] : fill;
      word[i] = bits == 0 ? low : low >> bits | high << (64 - bits);
    }
    return *this;
  }

  constexpr Wide operator-() const { return Wide() -= *this; }
  friend constexpr Wide operator+(Wide a, const Wide& b) { return a += b; }
  friend constexpr Wide operator-(Wide a, const Wide& b) { return a -= b; }
  friend constexpr Wide operator<<(Wide a, int count) { return a <<= count; }
  friend constexpr Wide operator>>(Wide a, int count) { return a >>= count; }
  friend constexpr bool operator==(const Wide&, const Wide&) = default;

  friend constexpr std::strong_ordering operator<=>(const Wide& a, const Wide& b) {
    const auto top = static_cast<std::int64_t>(a.word[kWords - 1]);
    const auto other_top = static_cast<std::int64_t>(b.word[kWords - 1]);
    if (top != other_top) return top <=> other_top;
    for (int i = kWords - 2; i >= 0; --i) {
      if (a.word[i] != b.word[i]) return a.word[i] <=> b.word[i];
    }
    return std::strong_ordering::equal;
  }
};

using Int192 = Wide<3>;
using Int256 = Wide<4>;
using Int320 = Wide<5>;
using Int640 = Wide<10>;

template <Narrow T>
constexpr Wide<(sizeof(T) + 7) / 8> as_wide(T value) {
  return value;
}
template <int kWords>
constexpr const Wide<kWords>& as_wide(const Wide<kWords>& value) {
  return value;
}

/// -1, 0 or 1.
template <Narrow T>
constexpr int sign_of(T value) {
  return (value > 0) - (value < 0);
}
template <int kWords>
constexpr int sign_of(const Wide<kWords>& value) {
  if (value.negative()) return -1;
  std::uint64_t any = 0;
  for (const std::uint64_t word : value.word) any |= word;
  return any != 0;
}

/// The value as a compiler's integer. @pre it fits
template <Narrow T, int kWords>
constexpr T narrow(const Wide<kWords>& value) {
  UInt128 low = value.word[0];
  if constexpr (kWords > 1) {
    low |= UInt128{value.word[1]} << 64;
  } else if (value.negative()) {
    low |= ~UInt128{0} << 64;
  }
  const T result = static_cast<T>(low);
  if constexpr (sizeof(T) <= 8 * kWords) assert(Wide<kWords>(result) == value);
  return result;
}

namespace wide_internal {

/// Subtracts other * 2^(64 kFirst) if it is wanted.
template <int kFirst, int kWords, int kOther>
[[gnu::always_inline]] constexpr void subtract_above(Wide<kWords>& from, const Wide<kOther>& other,
                                                     bool wanted) {
  const std::uint64_t mask = wanted ? ~std::uint64_t{0} : 0;
  UInt128 sum = 1;
  repeat<std::max(0, std::min(kOther, kWords - kFirst))>([&](auto i) {
    sum += UInt128{from.word[kFirst + i]} + ~(other.word[i] & mask);
    from.word[kFirst + i] = static_cast<std::uint64_t>(sum);
    sum >>= 64;
  });
}

/// Schoolbook product of the words; a negative factor was taken for one that is 2^(64 kWords) more,
/// so the other factor is subtracted that far up.
template <int kResult, int kA, int kB>
[[gnu::always_inline]] constexpr Wide<kResult> multiply(const Wide<kA>& a, const Wide<kB>& b) {
  static_assert(kResult <= kA + kB);
  Wide<kResult> result;
  repeat<std::min(kA, kResult)>([&](auto i) {
    UInt128 carry = 0;
    repeat<std::min(kB, kResult - i)>([&](auto j) {
      carry += UInt128{a.word[i]} * b.word[j] + result.word[i + j];
      result.word[i + j] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    });
    if constexpr (i + kB < kResult) result.word[i + kB] = static_cast<std::uint64_t>(carry);
  });
  subtract_above<kA>(result, b, a.negative());
  subtract_above<kB>(result, a, b.negative());
  return result;
}

/// Bits up to the highest one that is set; the magnitudes below are words, least first.
int bit_length(std::span<const std::uint64_t> magnitude);
/// @pre the divisor is not 0; quotient as long as the dividend, remainder as long as the divisor
void divide(std::span<const std::uint64_t> dividend, std::span<const std::uint64_t> divisor,
            std::span<std::uint64_t> quotient, std::span<std::uint64_t> remainder);
double to_double(std::span<const std::uint64_t> magnitude);
double ratio_to_double(std::span<const std::uint64_t> dividend,
                       std::span<const std::uint64_t> divisor);
std::string to_text(std::span<const std::uint64_t> magnitude, bool negative);

}  // namespace wide_internal

/// a * b in an integer type that the caller chooses. @pre the product fits
template <class Result, class A, class B>
constexpr Result product(const A& a, const B& b) {
  constexpr int kA = sizeof(as_wide(a)) / 8, kB = sizeof(as_wide(b)) / 8;
  constexpr int kResult = sizeof(Result) / 8;
  return wide_internal::multiply<std::min(kResult, kA + kB)>(as_wide(a), as_wide(b));
}

/// |value|, as the bits of an unsigned integer.
template <int kWords>
constexpr Wide<kWords> magnitude(const Wide<kWords>& value) {
  return value.negative() ? -value : value;
}

/// Bits of |value|: 0 for 0, 1 for 1, 2 for 2 and 3.
template <class T>
int bit_length(const T& value) {
  return wide_internal::bit_length(magnitude(as_wide(value)).word);
}

template <int kDividend, int kDivisor>
struct Division {
  Wide<kDividend> quotient;
  Wide<kDivisor> remainder;
};

/// quotient = floor(dividend / divisor); 0 <= remainder < divisor. @pre divisor > 0
template <int kDividend, int kDivisor>
Division<kDividend, kDivisor> divide_floor(const Wide<kDividend>& dividend,
                                           const Wide<kDivisor>& divisor) {
  assert(sign_of(divisor) > 0);
  Division<kDividend, kDivisor> result;
  wide_internal::divide(magnitude(dividend).word, divisor.word, result.quotient.word,
                        result.remainder.word);
  if (dividend.negative()) {
    result.quotient = -result.quotient;
    if (sign_of(result.remainder) != 0) {
      result.quotient -= 1;
      result.remainder = divisor - result.remainder;
    }
  }
  return result;
}

/// dividend / divisor rounded to the nearest whole number, ties up. @pre divisor > 0
template <int kDividend, int kDivisor>
Wide<kDividend> divide_round(const Wide<kDividend>& dividend, const Wide<kDivisor>& divisor) {
  const auto [quotient, remainder] = divide_floor(dividend, divisor);
  return remainder >= divisor - remainder ? quotient + Wide<kDividend>(1) : quotient;
}

/// The nearest double, ties to even.
template <int kWords>
double to_double(const Wide<kWords>& value) {
  const double result = wide_internal::to_double(magnitude(value).word);
  return value.negative() ? -result : result;
}

/// The double nearest to dividend / divisor, ties to even. @pre divisor > 0
template <int kDividend, int kDivisor>
double ratio_to_double(const Wide<kDividend>& dividend, const Wide<kDivisor>& divisor) {
  assert(sign_of(divisor) > 0);
  const double result = wide_internal::ratio_to_double(magnitude(dividend).word, divisor.word);
  return dividend.negative() ? -result : result;
}

/// Decimal digits.
template <class T>
std::string to_text(const T& value) {
  return wide_internal::to_text(magnitude(as_wide(value)).word, as_wide(value).negative());
}

}  // namespace strata::exact
