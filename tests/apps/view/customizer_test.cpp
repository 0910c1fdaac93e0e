#include "apps/view/files/customizer.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "apps/view/files/parameter_sets.h"
#include "tests/support/temporary_folder.h"

namespace strata::view {
namespace {

/// The parameter of a program, which must be there.
Parameter one(const std::string& program, const std::string& name) {
  for (Parameter& parameter : parse_parameters(program)) {
    if (parameter.name == name) return std::move(parameter);
  }
  ADD_FAILURE() << "no parameter " << name << " in: " << program;
  return {};
}
std::vector<std::string> names(const std::string& program) {
  std::vector<std::string> names;
  for (const Parameter& parameter : parse_parameters(program)) names.push_back(parameter.name);
  return names;
}
double number(const Parameter& parameter) { return std::get<double>(parameter.value); }

TEST(Customizer, NumbersHaveTheRangesOfTheirComments) {
  Parameter p = one("a = 20; // [5:50]\n", "a");
  EXPECT_EQ(number(p), 20);
  EXPECT_EQ(p.least, 5);
  EXPECT_EQ(p.most, 50);
  EXPECT_FALSE(p.step);
  p = one("a=-2.5;//[-5:0.5:50]\n", "a");
  EXPECT_EQ(number(p), -2.5);
  EXPECT_EQ(p.least, -5);
  EXPECT_EQ(p.step, 0.5);
  EXPECT_EQ(p.most, 50);
  p = one("a = 3; // [100]", "a");
  EXPECT_EQ(p.least, 0);
  EXPECT_EQ(p.most, 100);
  p = one("a = 3; // .5\n", "a");
  EXPECT_EQ(p.step, 0.5);
  EXPECT_FALSE(p.least);
  for (const char* none : {"a = 3; // [5:2]", "a = 3; // [x:2]", "a = 3; // [1:2:3:4]",
                           "a = 3; // []", "a = 3; // some words", "a = 3;", "a = 3; // [1:9"}) {
    p = one(none, "a");
    EXPECT_FALSE(p.least) << none;
  }
}

TEST(Customizer, ChoicesHaveValuesAndLabels) {
  Parameter p = one("a = 2; // [1, 2, 3]\n", "a");
  ASSERT_EQ(p.choices.size(), 3u);
  EXPECT_EQ(p.choices[2].value, ParameterValue(3.0));
  EXPECT_EQ(p.choices[2].label, "3");
  p = one("a = 2; // [1:small, 2:big one]\n", "a");
  ASSERT_EQ(p.choices.size(), 2u);
  EXPECT_EQ(p.choices[1].value, ParameterValue(2.0));
  EXPECT_EQ(p.choices[1].label, "big one");
  p = one("a = \"M\"; // [S:Small, M:\"a, b: c\", \"X,L\"]\n", "a");
  ASSERT_EQ(p.choices.size(), 3u);
  EXPECT_EQ(p.choices[0].value, ParameterValue(std::string("S")));
  EXPECT_EQ(p.choices[0].label, "Small");
  EXPECT_EQ(p.choices[1].label, "a, b: c");
  EXPECT_EQ(p.choices[2].value, ParameterValue(std::string("X,L")));
  EXPECT_TRUE(one("a = 2; // [1:small, two:big]", "a").choices.empty());
}

TEST(Customizer, TypesAreThoseOfTheValues) {
  EXPECT_EQ(one("a = true; // [1:2]", "a").value, ParameterValue(true));
  EXPECT_EQ(one("a = \"t // x\\\"y\"; // 12", "a").value, ParameterValue(std::string("t // x\"y")));
  EXPECT_EQ(one("a = \"t\"; // 12", "a").longest, 12u);
  const Parameter vector = one("a = [1, -2.5, 3]; // [0:2:50]", "a");
  EXPECT_EQ(vector.value, ParameterValue(std::vector<double>{1, -2.5, 3}));
  EXPECT_EQ(vector.most, 50);
  EXPECT_EQ(vector.step, 2);
  EXPECT_EQ(number(one("a = 1e-3;", "a")), 1e-3);
}

TEST(Customizer, OnlyLiteralsAtTheTopLevelBeforeTheFirstBraceAreParameters) {
  EXPECT_EQ(names("a = 1;\nb = a + 1;\nc = 2;\nuse <x.scad>\nd = [1, a];\ne = [1,2,3,4,5];\n"
                  "f = [1:5];\ng = undef;\nh = a == 1;\ncube(size = 3);\ni = 5;\n"),
            (std::vector<std::string>{"a", "c", "i"}));
  EXPECT_EQ(names("a = 1; // {\n/* { */ b = \"{\";\nc = 1; module m() {\n d = 4; }\ne = 5;"),
            (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(names("$fn = 30; 1a = 3; a b = 4; = 5;"), (std::vector<std::string>{"$fn"}));
  EXPECT_TRUE(names("").empty());
}

TEST(Customizer, ANameThatIsSetTwiceHasItsLastValue) {
  const auto all = parse_parameters("a = 1; // [0:5]\nb = 2;\na = 4;\nb = c;\n");
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(number(all[0]), 4);
  EXPECT_EQ(all[0].most, 5);
  EXPECT_EQ(all[0].line, 1);
}

TEST(Customizer, TabsAndDescriptionsAreComments) {
  const std::string program =
      "first = 1;\n"
      "/* [Size of it] */\n"
      "// How wide it is\n"
      "width = 20; // [5:50]\n"
      "  // indented: none\n"
      "deep = 3;\n"
      "/* a note */ high = 4;\n"
      "/* [Hidden] */\n"
      "secret = 7;\n"
      "/* [Rest]\n of more lines: none */\n"
      "also = 8;\n"
      "/*[Look]*/\n"
      "colour = \"red\";";
  EXPECT_EQ(names(program), (std::vector<std::string>{"first", "width", "deep", "high", "colour"}));
  EXPECT_EQ(one(program, "first").tab, "Parameters");
  EXPECT_EQ(one(program, "width").tab, "Size of it");
  EXPECT_EQ(one(program, "width").description, "How wide it is");
  EXPECT_EQ(one(program, "width").line, 4);
  EXPECT_EQ(one(program, "deep").description, "");
  EXPECT_EQ(one(program, "high").tab, "Size of it");
  EXPECT_EQ(one(program, "colour").tab, "Look");
}

TEST(Customizer, ACommentBehindTwoStatementsIsNobodys) {
  EXPECT_FALSE(one("a = 1; b = 2; // [0:5]", "a").least);
  EXPECT_FALSE(one("a = 1; b = 2; // [0:5]", "b").least);
  EXPECT_EQ(one("a = \";\"; // [x, y]", "a").choices.size(), 2u);
}

TEST(Customizer, EveryTruncatedProgramIsRead) {
  const std::string program =
      "/* [A] */\n// d\na = \"x\\\"\"; // [p:\"q\", r]\nb = [1, 2]; // [0:1:9]\nc = -.5e1; // 2\n{";
  for (std::size_t length = 0; length <= program.size(); ++length) {
    EXPECT_LE(parse_parameters(program.substr(0, length)).size(), 3u);
  }
  EXPECT_EQ(parse_parameters(program).size(), 3u);
  // Not quadratic: comments and quotes that never end.
  EXPECT_TRUE(parse_parameters(std::string(2'000'000, '/')).empty());
  std::string many;
  for (int i = 0; i < 200'000; ++i) many += "/*";
  EXPECT_TRUE(parse_parameters(many).empty());
}

TEST(Customizer, ValuesAreLiteralsForOpenscad) {
  EXPECT_EQ(literal_of(ParameterValue(true)), "true");
  EXPECT_EQ(literal_of(ParameterValue(-0.0)), "0");
  EXPECT_EQ(literal_of(ParameterValue(0.1)), "0.1");
  EXPECT_EQ(literal_of(ParameterValue(std::vector<double>{1, 2.5})), "[1, 2.5]");
  const std::string words = "a\"; cube(); // \\\n";
  EXPECT_EQ(literal_of(ParameterValue(words)), "\"a\\\"; cube(); // \\\\\\n\"");
  EXPECT_EQ(parse_literal(literal_of(ParameterValue(words))), ParameterValue(words));
  EXPECT_EQ(definitions_of({{"b", 2.0}, {"a", std::string("x")}}),
            (std::vector<std::string>{"-D", "a=\"x\"", "-D", "b=2"}));
}

TEST(Customizer, ValuesFromTextAreOfTheParametersType) {
  const auto refused = [](const std::string& program, const std::string& text) {
    const auto value = parse_value(one(program, "a"), text);
    EXPECT_FALSE(value) << text;
    return value ? std::string() : value.error().message;
  };
  EXPECT_EQ(parse_value(one("a = 1;", "a"), " 2.5 "), ParameterValue(2.5));
  EXPECT_EQ(parse_value(one("a = [1,2];", "a"), "[3, 4]"),
            ParameterValue(std::vector<double>{3, 4}));
  EXPECT_EQ(parse_value(one("a = \"x\";", "a"), "12"), ParameterValue(std::string("12")));
  EXPECT_EQ(refused("a = 1;", "x"), "the parameter a must be a number, got 'x'");
  EXPECT_EQ(refused("a = true;", "1"), "the parameter a must be true or false, got '1'");
  EXPECT_EQ(refused("a = [1,2];", "[3]"),
            "the parameter a must be 2 numbers such as [1, 2], got '[3]'");
  refused("a = 1;", "inf");
  refused("a = 1;", "");
}

class ParameterSetsTest : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return path_;
  }
  std::string read() {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  testkit::TemporaryFolder folder_;
  std::string path_ = folder_.file("part.json");
  std::vector<Parameter> parameters_ =
      parse_parameters("w = 1; // [0:9]\nname = \"a\";\non = false;\nv = [1, 2];\n");
};

TEST_F(ParameterSetsTest, AreReadAsOpenscadWritesThem) {
  const auto sets = read_parameter_sets(write(
      R"({"parameterSets": {"tall": {"w": "7.5", "name": "b c", "on": "true", "v": "[3, 4]",
          "gone": "1"}, "same": {"w": "1", "$fn": "8"}}, "fileFormatVersion": "1"})"));
  ASSERT_TRUE(sets) << sets.error().message;
  auto values = values_of_set(*sets, "tall", parameters_);
  ASSERT_TRUE(values) << values.error().message;
  EXPECT_EQ(*values, (ParameterValues{{"w", 7.5},
                                      {"name", std::string("b c")},
                                      {"on", true},
                                      {"v", std::vector<double>{3, 4}}}));
  values = values_of_set(*sets, "same", parameters_);
  ASSERT_TRUE(values);
  EXPECT_TRUE(values->empty());
  EXPECT_FALSE(values_of_set(*sets, "none", parameters_));
}

TEST_F(ParameterSetsTest, ASetThatIsSavedIsTheOneThatIsRead) {
  const ParameterValues values{{"w", 2.5}, {"name", std::string("\"\\\xc3\xa4\n")}};
  ASSERT_TRUE(write_parameter_set(path_, "mine", parameters_, values));
  ASSERT_TRUE(write_parameter_set(path_, "plain", parameters_, {}));
  const auto sets = read_parameter_sets(path_);
  ASSERT_TRUE(sets) << sets.error().message;
  EXPECT_EQ(sets->size(), 2u);
  EXPECT_EQ(values_of_set(*sets, "mine", parameters_), values);
  EXPECT_EQ(values_of_set(*sets, "plain", parameters_), ParameterValues());
  EXPECT_NE(read().find("\"fileFormatVersion\": \"1\""), std::string::npos);
}

TEST_F(ParameterSetsTest, OtherFilesAreRefusedAndKept) {
  for (const char* text : {"", "cube();", "[]", "{\"a\": 1}", "{\"parameterSets\": [1]}",
                           "{\"parameterSets\": {\"a\": 5}}"}) {
    write(text);
    const auto sets = read_parameter_sets(path_);
    ASSERT_FALSE(sets) << text;
    EXPECT_EQ(sets.error().code, ErrorCode::kInput);
    EXPECT_NE(sets.error().message.find("part.json"), std::string::npos);
    if (std::string(text).find("{\"a\": 5}") != std::string::npos) continue;
    EXPECT_FALSE(write_parameter_set(path_, "mine", parameters_, {})) << text;
    EXPECT_EQ(read(), text);
  }
  EXPECT_FALSE(read_parameter_sets(write(std::string(500'000, '['))));
  EXPECT_FALSE(read_parameter_sets(folder_.file("none.json")));
}

TEST_F(ParameterSetsTest, AValueOfAnotherTypeIsAnError) {
  const auto sets = read_parameter_sets(write(R"({"parameterSets": {"x": {"w": "wide"}}})"));
  ASSERT_TRUE(sets);
  const auto values = values_of_set(*sets, "x", parameters_);
  ASSERT_FALSE(values);
  EXPECT_EQ(values.error().message,
            "the parameter set 'x': the parameter w must be a number, got 'wide'");
}

}  // namespace
}  // namespace strata::view
