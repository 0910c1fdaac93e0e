#include "core/printable.h"

#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(Printable, ControlCharactersBecomeEscapes) {
  EXPECT_EQ(printable("plain text, \xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"),
            "plain text, \xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80");
  EXPECT_EQ(printable("a\x1b[31m\n\t\x7f"), "a\\x1b[31m\\x0a\\x09\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "1m"),
            "\\xc2\\x9b1m");  // U+009B begins sequences, too
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "cod"),
            "\\xe2\\x80\\xaecod");                          // right to left
  EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3");           // no UTF-8
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
}

TEST(Printable, LongTextsLoseTheirMiddle) {
  EXPECT_EQ(printable("abcdef", 6), "abcdef");
  EXPECT_EQ(printable("abcdefghij.stl", 9), "abcdef[...]stl");
  for (std::size_t most = 0; most < 12; ++most) {  // no character is cut in two
    const std::string text = printable("\xe2\x82\xac\xe2\x82\xac\xe2\x82\xac\xe2\x82\xac", most);
    EXPECT_EQ(text.find("\\x"), std::string::npos) << text;
  }
}

TEST(Printable, IndentedLinesStay) {
  EXPECT_EQ(printable_lines("no\n  a - b\n      ^\nforged"), "no\n  a - b\n      ^\\x0aforged");
}

}  // namespace
}  // namespace strata
