// The parts of the tool that need no run of it.

#include <gtest/gtest.h>

#include <limits>

#include "apps/session/json_writer.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

TEST(JsonWriter, NestsObjectsAndKeepsPlainArraysOnALine) {
  JsonWriter json;
  json.begin_object();
  json.member("a", 1);
  json.key("b").begin_array();
  json.value(1);
  json.value(2);
  json.end_array();
  json.key("c").begin_array();
  json.begin_object();
  json.end_object();
  json.end_array();
  json.key("d").begin_array();
  json.end_array();
  json.end_object();
  EXPECT_EQ(json.take(),
            "{\n  \"a\": 1,\n  \"b\": [1, 2],\n  \"c\": [\n    {}\n  ],\n  \"d\": []\n}\n");
}

TEST(JsonWriter, NumbersAreExact) {
  JsonWriter json;
  json.begin_array();
  json.value(0.1);
  json.value(std::numeric_limits<std::uint64_t>::max());
  json.value(1e300);
  json.value(std::numeric_limits<double>::quiet_NaN());
  json.value(-std::numeric_limits<double>::infinity());
  json.value(true);
  json.end_array();
  EXPECT_EQ(json.take(), "[0.1, 18446744073709551615, 1e+300, null, null, true]\n");
}

TEST(JsonWriter, TextIsEscapedAndMadeUtf8) {
  JsonWriter json;
  // An overlong slash, a surrogate, a sequence cut short.
  json.value(std::string_view("\"\\\x01\t\xc3\xa9\xf0\x9f\x98\x80|\xc0\xaf|\xed\xa0\x80|\xe2\x82"));
  EXPECT_EQ(json.take(),
            "\"\\\"\\\\\\u0001\\u0009\xc3\xa9\xf0\x9f\x98\x80|\\ufffd\\ufffd|\\ufffd\\ufffd\\ufffd|"
            "\\ufffd\\ufffd\"\n");
}

TEST(OptionValues, BytesTakeUnits) {
  const auto bytes = [](const char* text) { return parse_bytes("--x", text).value_or(0); };
  EXPECT_EQ(bytes("1"), 1u);
  EXPECT_EQ(bytes("2K"), 2048u);
  EXPECT_EQ(bytes("1.5M"), 1572864u);
  EXPECT_EQ(bytes("3g"), 3221225472u);
  EXPECT_EQ(bytes("3GB"), 3221225472u);
  EXPECT_EQ(bytes("3GiB"), 3221225472u);
  for (const char* text : {"", "K", "-1", "0", "1Q", "1e30", "nan", "1 G", "0.5"}) {
    EXPECT_FALSE(parse_bytes("--x", text).has_value()) << text;
  }
}

TEST(OptionValues, IntegersAreWhole) {
  EXPECT_EQ(parse_integer("-r", "+12").value_or(0), 12);
  EXPECT_EQ(parse_integer("-r", "-12").value_or(0), -12);
  for (const char* text : {"", "12.0", "0x10", "9223372036854775808", "1 ", " 1", "--1"}) {
    EXPECT_FALSE(parse_integer("-r", text).has_value()) << text;
  }
}

TEST(OptionValues, NumbersComeInTheCountsAskedFor) {
  EXPECT_EQ(parse_numbers("-s", "1", 1, 3)->size(), 1u);
  EXPECT_EQ(parse_numbers("-s", "1,-2.5,3e-4", 1, 3)->at(2), 3e-4);
  for (const char* text : {"", "1,2", "1,2,3,4", "1,,3", "1,2,x", "1,2,inf", "1,2,nan", "1,2,"}) {
    EXPECT_FALSE(parse_numbers("-s", text, 1, 3).has_value()) << text;
  }
}

}  // namespace
}  // namespace strata::apps
