#include <cmath>
#include <string>

#include "csg/scene/csg_parser.h"
#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

Ast parsed(std::string_view text) {
  auto ast = parse_csg(text, "test.csg");
  EXPECT_TRUE(ast.has_value()) << ast.error().message << "\n" << text;
  return ast ? *std::move(ast) : Ast{};
}

/// The first argument of the first node.
ValueRef first_value(const Ast& ast) { return {ast, ast.arguments.at(0).value}; }

double parsed_number(const std::string& text) {
  const std::string whole = "cube(" + text + ");";
  const Ast ast = parsed(whole);
  const ValueRef value = first_value(ast);
  EXPECT_TRUE(value.is_number()) << text;
  return value.number(-7.25);
}

std::string parsed_string(const std::string& text) {
  const std::string whole = "text(\"" + text + "\");";
  const Ast ast = parsed(whole);
  return first_value(ast).string();
}

TEST(CsgParser, NodesLieInPreorderWithTheEndOfTheirSubtrees) {
  const Ast ast = parsed("union() { cube(); group() { sphere(); } }\ncylinder();");
  ASSERT_EQ(ast.nodes.size(), 5u);
  const char* names[] = {"union", "cube", "group", "sphere", "cylinder"};
  const std::uint32_t ends[] = {4, 2, 4, 4, 5};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(ast.nodes[i].name, names[i]);
    EXPECT_EQ(ast.nodes[i].end, ends[i]) << i;
  }
}

TEST(CsgParser, EveryFormOfNumberIsReadWithoutALocale) {
  EXPECT_EQ(parsed_number("12"), 12.0);
  EXPECT_EQ(parsed_number("-0.5"), -0.5);
  EXPECT_EQ(parsed_number("+3"), 3.0);
  EXPECT_EQ(parsed_number(".25"), 0.25);
  EXPECT_EQ(parsed_number("5."), 5.0);
  EXPECT_EQ(parsed_number("1e+06"), 1e6);
  EXPECT_EQ(parsed_number("2.5E-3"), 2.5e-3);
  EXPECT_EQ(parsed_number("69.282"), 69.282);
  EXPECT_EQ(parsed_number("inf"), INFINITY);
  EXPECT_EQ(parsed_number("-inf"), -INFINITY);
  EXPECT_TRUE(std::isnan(parsed_number("nan")));
  EXPECT_TRUE(std::isnan(parsed_number("-nan")));
  EXPECT_EQ(parsed_number("1e999"), INFINITY);
  EXPECT_EQ(parsed_number("-1e999"), -INFINITY);
  EXPECT_EQ(parsed_number("1e-999"), 0.0);
}

TEST(CsgParser, NonsenseNumbersAreRefusedAtTheirPlace) {
  for (const char* text : {"1.2.3", "--1", "+-1", "1e", "e5", "0x10", "1,,2", "-", ".", "infinity",
                           "1 2", "12abc", "- 1", "1e+", "nan(1)"}) {
    const std::string message = refusal_of("cube(" + std::string(text) + ");");
    EXPECT_TRUE(message.starts_with("test.csg:1:")) << text << ": " << message;
  }
  EXPECT_EQ(refusal_of("cube();\n\tcube(size = 1.2.3);"),
            "test.csg:2:17: expected the end of a number, not '.'");
}

TEST(CsgParser, StringsTakeOpenScadsEscapes) {
  EXPECT_EQ(parsed_string("a\\\"b\\\\c\\nd\\te\\rf"), "a\"b\\c\nd\te\rf");
  EXPECT_EQ(parsed_string("\\x41\\u00e4\\U01F600"), "A\xc3\xa4\xf0\x9f\x98\x80");
  EXPECT_EQ(parsed_string("two\nlines"), "two\nlines");
  // What is no escape stays as it is.
  EXPECT_EQ(parsed_string("\\q \\x4 \\ud800 \\x00 \\U110000"), "\\q \\x4 \\ud800 \\x00 \\U110000");
}

TEST(CsgParser, ListsNestAndMayEndInAComma) {
  const Ast ast = parsed("polygon([[1, [2], []], 3, [4,],], true);");
  const ValueRef list = first_value(ast);
  ASSERT_TRUE(list.is_list());
  std::size_t count = 0;
  double last = 0;
  for (const ValueRef element : list) {
    ++count;
    if (element.is_number()) {
      EXPECT_EQ(element.number(0), 3.0);
    }
    double numbers[4];
    if (element.numbers(numbers, 4) > 0) last = numbers[0];
  }
  EXPECT_EQ(count, 3u);
  EXPECT_EQ(last, 4.0);
}

TEST(CsgParser, CommentsModifiersAndStraySemicolonsAreTaken) {
  const Ast ast = parsed(
      "\xef\xbb\xbf// a line\n;;/* some\n lines */ #\tcube(); %\n!*sphere() /* here too */ ;"
      "union( /* */ ) { ; }");
  ASSERT_EQ(ast.nodes.size(), 3u);
  EXPECT_EQ(ast.nodes[0].modifiers, AstNode::kHighlight);
  EXPECT_EQ(ast.nodes[1].modifiers, AstNode::kBackground | AstNode::kRoot | AstNode::kDisabled);
  EXPECT_EQ(ast.nodes[2].modifiers, 0);
}

TEST(CsgParser, WideTextIsNamed) {
  for (const bool marked : {true, false}) {
    std::string wide = marked ? "\xff\xfe" : "";
    for (const char c : std::string("cube(size = [1, 1, 1]);\n")) wide += {c, '\0'};
    const auto ast = parse_csg(wide, "t.csg");
    ASSERT_FALSE(ast.has_value());
    EXPECT_EQ(ast.error().code, ErrorCode::kInput);
    EXPECT_NE(ast.error().message.find("t.csg: the file is UTF-16 text"), std::string::npos)
        << ast.error().message;
  }
}

TEST(CsgParser, AChildMayStandWithoutBraces) {
  const Ast ast = parsed("color([1,0,0]) multmatrix([]) cube(); sphere();");
  ASSERT_EQ(ast.nodes.size(), 4u);
  EXPECT_EQ(ast.nodes[0].end, 3u);
  EXPECT_EQ(ast.nodes[1].end, 3u);
  EXPECT_EQ(ast.nodes[3].end, 4u);
}

TEST(CsgParser, ErrorsNameFileLineAndColumn) {
  EXPECT_EQ(refusal_of("cube()"),
            "test.csg:1:7: expected ';' or '{' after 'cube(...)', not the "
            "end of the file");
  EXPECT_EQ(refusal_of("\n\n  }"), "test.csg:3:3: '}' without '{'");
  EXPECT_EQ(refusal_of("union() {\n cube();"),
            "test.csg:2:9: the file ends inside 'union', which begins at test.csg:1:1");
  EXPECT_EQ(refusal_of("cube(size = [1, 2);"), "test.csg:1:18: expected ',' or ']', not ')'");
  EXPECT_EQ(refusal_of("/* x"), "test.csg:1:1: the comment is not closed");
  EXPECT_EQ(refusal_of("text(\"x"), "test.csg:1:6: the string is not closed");
  EXPECT_EQ(refusal_of("# ;"), "test.csg:1:3: expected a name after a modifier, not ';'");
  EXPECT_EQ(refusal_of("cube(\x01);"), "test.csg:1:6: expected a value, not byte 0x01");
  EXPECT_NE(refusal_of("module a() { }").find("openscad -o"), std::string::npos);
  EXPECT_NE(refusal_of("x = 3;").find("openscad -o"), std::string::npos);
}

/// Every part of the language in a few lines.
constexpr std::string_view kSmall =
    "%group() {\n\tmultmatrix([[1, 0, 0, -2.5e1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) {\n"
    "#\t\tcylinder($fn = 8, $fa = 12, $fs = 2, h = 1, r1 = 1, r2 = inf, center = false);\n"
    "/* c */ text(text = \"a\\\"\\u00e4\", size = 10); // d\n\t}\n}\n"
    "polygon(points = [[0, 0], [1, 0], [0, 1]], paths = undef, convexity = 1);;\n";

TEST(CsgParser, EveryTruncationIsReadOrRefusedWithAPlace) {
  std::size_t refused = 0;
  for (std::size_t length = 0; length <= kSmall.size(); ++length) {
    const std::string text(kSmall.substr(0, length));  // own memory: reading past its end shows
    const auto ast = parse_csg(text, "test.csg");
    if (ast) continue;
    ++refused;
    EXPECT_EQ(ast.error().code, ErrorCode::kInput);
    EXPECT_TRUE(ast.error().message.starts_with("test.csg:")) << ast.error().message;
  }
  EXPECT_GT(refused, kSmall.size() / 2);
  EXPECT_TRUE(parse_csg(kSmall, "test.csg").has_value());
}

TEST(CsgParser, EverySingleByteChangeIsReadOrRefused) {
  for (std::size_t at = 0; at < kSmall.size(); ++at) {
    for (const char c : {'\0', '{', '}', '[', ')', '"', '*', '/', '\\', '9', '\xff'}) {
      std::string text(kSmall);
      text[at] = c;
      const auto ast = parse_csg(text, "test.csg");
      if (!ast) {
        EXPECT_TRUE(ast.error().message.starts_with("test.csg:"));
      }
    }
  }
}

TEST(CsgParser, AHundredThousandLevelsAreFine) {
  constexpr int kLevels = 100'000;
  const Ast nodes = parsed(repeated("group(){", kLevels) + "cube();" + repeated("}", kLevels));
  EXPECT_EQ(nodes.nodes.size(), kLevels + 1u);
  const std::string lists = "cube(" + repeated("[", kLevels) + repeated("]", kLevels) + ");";
  EXPECT_EQ(parsed(lists).values.size(), std::size_t{kLevels});
  EXPECT_EQ(parsed(repeated("group()", kLevels) + ";").nodes.size(), std::size_t{kLevels});
  const std::string unclosed = refusal_of(repeated("group(){", kLevels));
  EXPECT_NE(unclosed.find("the file ends inside 'group'"), std::string::npos);
}

TEST(CsgParser, AMillionNumbersTakeOneFlatArray) {
  const std::string text =
      "polyhedron(points = [" + repeated("[1.5, -2, 3e2],", 400'000) + "], faces = []);";
  const Ast ast = parsed(text);
  EXPECT_EQ(ast.values.size(), 1u + 4u * 400'000u + 1u);
  EXPECT_TRUE(ast.strings.empty());
}

}  // namespace
}  // namespace strata::csg
