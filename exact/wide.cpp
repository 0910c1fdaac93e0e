#include "exact/wide.h"

#include <cmath>
#include <vector>

// This work is based on: D. Knuth, The Art of Computer Programming 2, 4.3.1, algorithm D, 1969.
// We differ: digits have 64 bits.

namespace strata::exact::wide_internal {
namespace {

constexpr std::size_t kMostWords = 32;  // of a dividend, with the room that a ratio needs

std::size_t words_used(std::span<const std::uint64_t> magnitude) {
  std::size_t count = magnitude.size();
  while (count > 0 && magnitude[count - 1] == 0) --count;
  return count;
}

// value << shift for 0 <= shift < 64; the result has one more word.
void shift_left(std::span<const std::uint64_t> value, int shift, std::span<std::uint64_t> result) {
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    result[i] = shift == 0 ? value[i] : value[i] << shift | below >> (64 - shift);
    below = value[i];
  }
  result[value.size()] = shift == 0 ? 0 : below >> (64 - shift);
}

void divide_by_word(std::span<const std::uint64_t> dividend, std::uint64_t divisor,
                    std::span<std::uint64_t> quotient, std::uint64_t& remainder) {
  remainder = 0;
  for (std::size_t i = dividend.size(); i-- > 0;) {
    const UInt128 part = UInt128{remainder} << 64 | dividend[i];
    quotient[i] = static_cast<std::uint64_t>(part / divisor);
    remainder = static_cast<std::uint64_t>(part % divisor);
  }
}

// The digit of the quotient that belongs to the words of `rest`, which has one word more than the
// divisor; what is left stays in `rest`. The highest bit of the divisor is set.
std::uint64_t next_digit(std::span<std::uint64_t> rest, std::span<const std::uint64_t> divisor) {
  const std::size_t count = divisor.size();
  const std::uint64_t top = divisor[count - 1], second = divisor[count - 2];
  const UInt128 head = UInt128{rest[count]} << 64 | rest[count - 1];
  std::uint64_t digit = ~std::uint64_t{0};
  UInt128 left = UInt128{rest[count - 1]} + top;
  if (rest[count] < top) {
    digit = static_cast<std::uint64_t>(head / top);
    left = head - UInt128{digit} * top;
  }
  while (left >> 64 == 0 && UInt128{digit} * second > (left << 64 | rest[count - 2])) {
    --digit;
    left += top;
  }
  UInt128 carry = 0, sum = 1;
  for (std::size_t i = 0; i <= count; ++i) {
    if (i < count) carry += UInt128{digit} * divisor[i];
    sum += UInt128{rest[i]} + ~static_cast<std::uint64_t>(carry);
    rest[i] = static_cast<std::uint64_t>(sum);
    carry >>= 64;
    sum >>= 64;
  }
  if (sum == 0) {  // the digit was one too large
    --digit;
    UInt128 back = 0;
    for (std::size_t i = 0; i < count; ++i) {
      back += UInt128{rest[i]} + divisor[i];
      rest[i] = static_cast<std::uint64_t>(back);
      back >>= 64;
    }
    rest[count] += static_cast<std::uint64_t>(back);
  }
  return digit;
}

}  // namespace

int bit_length(std::span<const std::uint64_t> magnitude) {
  const std::size_t count = words_used(magnitude);
  if (count == 0) return 0;
  return static_cast<int>(64 * count) - std::countl_zero(magnitude[count - 1]);
}

void divide(std::span<const std::uint64_t> dividend, std::span<const std::uint64_t> divisor,
            std::span<std::uint64_t> quotient, std::span<std::uint64_t> remainder) {
  std::ranges::fill(quotient, 0);
  std::ranges::fill(remainder, 0);
  dividend = dividend.first(words_used(dividend));
  divisor = divisor.first(words_used(divisor));
  assert(!divisor.empty() && dividend.size() < kMostWords);
  if (divisor.size() == 1) return divide_by_word(dividend, divisor[0], quotient, remainder[0]);
  if (dividend.size() < divisor.size()) {
    std::ranges::copy(dividend, remainder.begin());
    return;
  }
  const int shift = std::countl_zero(divisor.back());
  std::uint64_t rest[kMostWords], high[kMostWords];
  shift_left(dividend, shift, rest);
  shift_left(divisor, shift, high);
  const std::size_t count = divisor.size();
  for (std::size_t i = dividend.size() - count + 1; i-- > 0;) {
    quotient[i] = next_digit({rest + i, count + 1}, {high, count});
  }
  for (std::size_t i = 0; i < count; ++i) {
    remainder[i] = shift == 0 ? rest[i] : rest[i] >> shift | rest[i + 1] << (64 - shift);
  }
}

double to_double(std::span<const std::uint64_t> magnitude) {
  const int bits = bit_length(magnitude);
  if (bits <= 64) return magnitude.empty() ? 0 : static_cast<double>(magnitude[0]);
  // The highest 64 bits, the last of which also stands for all that follow: it is far below the
  // last bit of a double, so that one conversion rounds as the whole number asks.
  const int drop = bits - 64;
  const auto first = static_cast<std::size_t>(drop / 64);
  const int shift = drop % 64;
  std::uint64_t top = magnitude[first] >> shift;
  if (shift != 0) top |= magnitude[first + 1] << (64 - shift);
  bool more = (magnitude[first] & ((std::uint64_t{1} << shift) - 1)) != 0;
  for (std::size_t i = 0; i < first; ++i) more = more || magnitude[i] != 0;
  return std::ldexp(static_cast<double>(top | (more ? 1 : 0)), drop);
}

double ratio_to_double(std::span<const std::uint64_t> dividend,
                       std::span<const std::uint64_t> divisor) {
  // Shifted so that the quotient has more than 64 bits; its last bit then also stands for the
  // remainder.
  const int shift = std::max(0, 66 - (bit_length(dividend) - bit_length(divisor)));
  const auto words = static_cast<std::size_t>(shift / 64);
  std::uint64_t shifted[kMostWords] = {}, quotient[kMostWords] = {}, remainder[kMostWords] = {};
  assert(words + dividend.size() + 1 < kMostWords);
  shift_left(dividend, shift % 64, {shifted + words, dividend.size() + 1});
  const std::size_t count = words + dividend.size() + 1;
  divide({shifted, count}, divisor, {quotient, count}, {remainder, divisor.size()});
  if (words_used({remainder, divisor.size()}) != 0) quotient[0] |= 1;
  return std::ldexp(to_double({quotient, count}), -shift);
}

std::string to_text(std::span<const std::uint64_t> magnitude, bool negative) {
  std::vector<std::uint64_t> rest(magnitude.begin(), magnitude.end());
  std::string digits;
  do {
    std::uint64_t digit = 0;
    divide_by_word(rest, 10, rest, digit);
    digits.push_back(static_cast<char>('0' + digit));
  } while (words_used(rest) != 0);
  if (negative) digits.push_back('-');
  std::ranges::reverse(digits);
  return digits;
}

}  // namespace strata::exact::wide_internal
