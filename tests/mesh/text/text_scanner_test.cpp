#include "mesh/text/text_scanner.h"

#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <random>
#include <string>

namespace strata::detail {
namespace {

/// The bits that a string reads as; fails the test when the scanner stops elsewhere than at the
/// end.
double scanned(const std::string& text) {
  double value = -7.0;
  const char* stop = parse_double(text.c_str(), value);
  EXPECT_EQ(stop, text.c_str() + text.size()) << text;
  return value;
}

TEST(TextScanner, DoublesAreCorrectlyRoundedOnEveryPath) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 200000; ++i) {
    std::string text;
    if (random() % 2 != 0) text += '-';
    const auto digits = [&](std::uint64_t most) {
      for (std::uint64_t n = random() % (most + 1); n != 0; --n) {
        text += static_cast<char>('0' + random() % 10);
      }
    };
    text += static_cast<char>('0' + random() % 10);
    digits(random() % 4 == 0 ? 30 : 6);
    if (random() % 4 != 0) {
      text += '.';
      digits(random() % 4 == 0 ? 30 : 9);
    }
    if (random() % 3 == 0) {
      text += random() % 2 != 0 ? 'e' : 'E';
      const char* signs[] = {"", "-", "+"};
      text += signs[random() % 3];
      text += std::to_string(random() % (random() % 4 == 0 ? 400 : 25));
    }
    ASSERT_EQ(scanned(text), std::strtod(text.c_str(), nullptr)) << text;
  }
}

TEST(TextScanner, ShortestDecimalsComeBack) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    char text[40];
    const auto result = std::to_chars(text, text + sizeof text, value);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(scanned(std::string(text, result.ptr))),
              std::bit_cast<std::uint64_t>(value));
  }
}

TEST(TextScanner, HalfWayCasesAndEdgesOfTheFastPath) {
  for (const char* text : {"9007199254740992",
                           "9007199254740993",
                           "9007199254740991e22",
                           "9007199254740991e23",
                           "1e22",
                           "1e23",
                           "1e-22",
                           "1e-23",
                           "8.5",
                           "123456789012345678",
                           "1234567890123456789",
                           "12345678901234567890",
                           "0.000000000000000000000000000001",
                           "00000000000000000000001",
                           "4.9e-324",
                           "2.4703282292062327e-324",
                           "2.2250738585072011e-308",
                           "1.7976931348623157e308",
                           ".5",
                           "5.",
                           "-.5e1",
                           "0",
                           "-0",
                           "0.0000",
                           "1e+5"}) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(scanned(text)),
              std::bit_cast<std::uint64_t>(std::strtod(text, nullptr)))
        << text;
  }
}

TEST(TextScanner, LongMantissasAreCorrectlyRoundedHalfWayToo) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 200000; ++i) {
    std::string text;
    if (i % 2 == 0) {  // 16 to 19 digits, the point anywhere
      text = std::to_string(1 + random() % 9);
      for (std::uint64_t n = 15 + random() % 4; n != 0; --n) {
        text += static_cast<char>('0' + random() % 10);
      }
      text.insert(random() % (text.size() + 1), 1, '.');
    } else {  // half way between two doubles, or a little beside it
      const std::uint64_t low = std::uint64_t{1} << (51 + random() % 3);
      const std::uint64_t whole = low + random() % low;
      const char* const quarters[] = {"0", "25", "5", "75", "26", "24", "51", "49", "01", "99"};
      text = std::to_string(whole) + '.' + quarters[random() % std::size(quarters)];
    }
    ASSERT_EQ(std::bit_cast<std::uint64_t>(scanned(text)),
              std::bit_cast<std::uint64_t>(std::strtod(text.c_str(), nullptr)))
        << text;
  }
}

TEST(TextScanner, OutOfRangeIsInfiniteOrZero) {
  EXPECT_EQ(scanned("1e999"), HUGE_VAL);
  EXPECT_EQ(scanned("-1e309"), -HUGE_VAL);
  EXPECT_EQ(scanned("1e99999999999999999999"), HUGE_VAL);
  EXPECT_EQ(scanned("1e-999"), 0.0);
  EXPECT_TRUE(std::signbit(scanned("-1e-400")));
  EXPECT_EQ(scanned("0.001e-330"), 0.0);
  EXPECT_EQ(scanned("0e99999"), 0.0);
  EXPECT_EQ(scanned(std::string(400, '9')), HUGE_VAL);
  EXPECT_EQ(scanned("0." + std::string(400, '0') + "1"), 0.0);
}

TEST(TextScanner, NotANumberIsRead) {
  for (const char* text : {"nan", "NaN", "-nan", "nan(ind)", "-nan(ind)", "1.#QNAN", "-1.#IND00"}) {
    EXPECT_TRUE(std::isnan(scanned(text))) << text;
  }
  EXPECT_EQ(scanned("inf"), HUGE_VAL);
  EXPECT_EQ(scanned("-Infinity"), -HUGE_VAL);
  EXPECT_FALSE(std::isfinite(scanned("1.#INF")));
}

TEST(TextScanner, WhatIsNoNumberIsRefused) {
  for (const char* text : {"", "-", "+", ".", "-.", "e5", "x", "+-1", "--1", "#", "/1"}) {
    double value = 0.0;
    EXPECT_EQ(parse_double(text, value), nullptr) << text;
  }
}

TEST(TextScanner, StopsBehindTheNumber) {
  for (const char* text : {"1#", "1,5", "1/2", "1e", "1e+", "1x", "1 2", "1.5f"}) {
    double value = 0.0;
    const char* stop = parse_double(text, value);
    ASSERT_NE(stop, nullptr) << text;
    EXPECT_EQ(std::floor(value), 1.0) << text;
    EXPECT_NE(*stop, '\0') << text;
  }
}

TEST(TextScanner, IntegersStopAtTheirBound) {
  std::int64_t value = 0;
  ASSERT_NE(parse_integer("-12", value), nullptr);
  EXPECT_EQ(value, -12);
  ASSERT_NE(parse_integer("+7", value), nullptr);
  EXPECT_EQ(value, 7);
  ASSERT_NE(parse_integer("99999999999999999999999999", value), nullptr);
  EXPECT_GT(value, std::int64_t{1} << 61);
  ASSERT_NE(parse_integer("-99999999999999999999999999", value), nullptr);
  EXPECT_LT(value, -(std::int64_t{1} << 61));
  EXPECT_EQ(parse_integer("-", value), nullptr);
  EXPECT_EQ(parse_integer("a", value), nullptr);
}

TEST(TextScanner, LinesAreCountedForAllLineEnds) {
  const std::string text = "a\nb\r\nc\rd";
  EXPECT_EQ(line_of(text, text.data()), 1u);
  EXPECT_EQ(line_of(text, text.data() + 2), 2u);
  EXPECT_EQ(line_of(text, text.data() + 5), 3u);
  EXPECT_EQ(line_of(text, text.data() + 7), 4u);
}

}  // namespace
}  // namespace strata::detail
