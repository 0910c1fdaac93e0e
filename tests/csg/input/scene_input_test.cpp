#include "strata/csg/input/scene_input.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "csg/input/input_parts.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/measure/measure.h"

namespace strata::csg {
namespace {

/// A folder with two boxes as OFF and one as a scene; sides 2, along x at 0, 1 and 10.
class SceneInputs : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("strata_input_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    write("a.off", box(0, false));
    write("b.off", box(1, false));
    write("turned.off", box(0, true));
    write("c.csg",
          "multmatrix([[1,0,0,10],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { cube(size=[2,2,2]); }\n");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string box(int x, bool inside_out) {
    std::string text = "OFF\n8 6 0\n";
    for (int i = 0; i < 8; ++i) {
      text += std::to_string(x + 2 * (i & 1)) + ' ' + std::to_string((i & 2)) + ' ' +
              std::to_string((i & 4) / 2) + '\n';
    }
    const char* out[] = {"4 0 2 3 1\n", "4 4 5 7 6\n", "4 0 1 5 4\n",
                         "4 2 6 7 3\n", "4 0 4 6 2\n", "4 1 3 7 5\n"};
    const char* in[] = {"4 1 3 2 0\n", "4 6 7 5 4\n", "4 4 5 1 0\n",
                        "4 3 7 6 2\n", "4 2 6 4 0\n", "4 5 7 3 1\n"};
    for (const char* face : inside_out ? in : out) text += face;
    return text;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  [[nodiscard]] SceneInput input(const std::vector<std::string>& names,
                                 const std::string& expression = {}) const {
    SceneInput result;
    for (const std::string& name : names) result.files.push_back((folder_ / name).string());
    result.expression = expression;
    return result;
  }
  static double volume_of(const Scene& scene) {
    const auto found = measure(scene.tree, scene.tree.root(), {.resolution = 256});
    EXPECT_TRUE(found.has_value());
    return found ? found->volume : -1;
  }

  std::filesystem::path folder_;
};

TEST_F(SceneInputs, SeveralFilesAreUnited) {
  const auto scene = load_scene(input({"a.off", "b.off", "c.csg"}));
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(scene->tree.solids().size(), 3u);
  EXPECT_NEAR(volume_of(*scene), 12 + 8, 0.2);
}

TEST_F(SceneInputs, AnExpressionSaysWhatIsMadeOfThem) {
  for (const auto& [expression, volume] :
       {std::pair("a - b", 4.0), std::pair("a * b", 4.0), std::pair("a ^ b", 8.0)}) {
    const auto scene = load_scene(input({"a.off", "b.off"}, expression));
    ASSERT_TRUE(scene.has_value()) << scene.error().message;
    EXPECT_NEAR(volume_of(*scene), volume, 0.1) << expression;
  }
  const auto refused = load_scene(input({"a.off", "b.off"}, "a - nobody"));
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
}

TEST_F(SceneInputs, AnExpressionOfMeshesDecidesTheSolidsToo) {
  write("far.off", box(5, false));
  const auto both = load_solids(input({"a.off", "b.off"}, "a * b"));
  ASSERT_TRUE(both.has_value()) << both.error().message;
  EXPECT_EQ(both->bounds.low, glm::dvec3(1, 0, 0));
  EXPECT_EQ(both->bounds.high, glm::dvec3(2, 2, 2));
  const auto rest = load_solids(input({"a.off", "b.off"}, "b - a"));
  ASSERT_TRUE(rest.has_value()) << rest.error().message;
  ASSERT_TRUE(rest->tree && rest->scene);
  EXPECT_TRUE(rest->closed);
  EXPECT_EQ(rest->files.size(), 2u);
  EXPECT_EQ(rest->bounds.low.x, 1);
  EXPECT_EQ(rest->scene->nodes()[rest->scene->root()].operation, Operation::kDifference);
  std::size_t subtracted = 0;
  for (std::uint32_t t = 0; t < rest->soup.triangles.size(); ++t) {
    subtracted += rest->tree->is_subtracted(t) ? 1 : 0;
  }
  EXPECT_EQ(subtracted, 12u);  // the triangles of a
  const auto nothing = load_solids(input({"a.off", "far.off"}, "a * b"));
  ASSERT_FALSE(nothing.has_value());
  EXPECT_EQ(nothing.error().code, ErrorCode::kGeometry);
  EXPECT_NE(nothing.error().message.find("result of the expression is empty"), std::string::npos);
  const auto mistake = load_solids(input({"a.off"}, "a -"));
  ASSERT_FALSE(mistake.has_value());
  EXPECT_EQ(mistake.error().code, ErrorCode::kUsage);
}

TEST_F(SceneInputs, ErrorsDoNotNameOptionsOfTheTool) {
  write("plain.txt", "a poem\n");
  for (const auto& [name, expression] :
       {std::pair("a.off", "a - nobody"), std::pair("-", ""), std::pair("plain.txt", "")}) {
    SceneInput given = input({name}, expression);
    if (given.files[0].ends_with("/-")) given.files[0] = "-";
    const auto scene = load_scene(given);
    const auto solids = load_solids(given);
    ASSERT_TRUE(!scene && !solids) << name;
    EXPECT_EQ(scene.error().message.find("--"), std::string::npos) << scene.error().message;
    EXPECT_EQ(solids.error().message.find("--"), std::string::npos) << solids.error().message;
  }
}

TEST_F(SceneInputs, AMeshIsInspectedTurnedAndWarnedOf) {
  std::vector<std::string> codes;
  InputMessages messages;
  messages.warn = [&](const std::string& code, const std::string&) { codes.push_back(code); };
  std::vector<InputFacts> facts;
  const auto scene = load_scene(input({"turned.off"}), messages, {}, &facts);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(codes, std::vector<std::string>{"inverted"});
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_TRUE(facts[0].closed && facts[0].turned_around);
  EXPECT_NEAR(facts[0].volume, 8, 1e-9);
  EXPECT_NEAR(facts[0].area, 24, 1e-9);
  EXPECT_NEAR(facts[0].longest_edge, std::sqrt(8.0), 1e-9);
}

TEST_F(SceneInputs, OpenedFilesMayBeRefused) {
  InputMessages messages;
  messages.opened = [](std::span<const FileIdentity> files) -> Result<void> {
    if (files.empty()) return {};
    return fail(ErrorCode::kUsage, "not {}", files.front().path);
  };
  EXPECT_TRUE(load_scene(input({"a.off"}), messages).has_value());  // a mesh opens no others
  EXPECT_FALSE(load_scene(input({"c.csg"}), messages).has_value());
}

TEST_F(SceneInputs, ASectionTakesAwayTheHalfItSays) {
  auto scene = load_scene(input({"a.off"}));
  ASSERT_TRUE(scene.has_value());
  const SectionPlane cut{{1, 0, 0}, 0.5, false};  // keeps x below 0.5
  cut_scene(*scene, {&cut, 1}, Camera{});
  EXPECT_NEAR(volume_of(*scene), 2, 0.05);
}

TEST(InputProgress, NeverGoesBackOverSeveralFiles) {
  std::vector<double> seen;
  Execution whole;
  whole.progress = [&](double done) { seen.push_back(done); };
  for (std::size_t part = 0; part < 3; ++part) {
    const Execution one = detail::part_of(whole, part, 3);
    for (const double done : {0.0, 0.5, 1.0, 1.5}) one.progress(done);
  }
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_DOUBLE_EQ(seen.front(), 0.0);
  EXPECT_DOUBLE_EQ(seen.back(), 1.0);
}

TEST_F(SceneInputs, ANameTellsTheKindUnlessAFormatIsGiven) {
  SceneInput files = input({"a.off"});
  EXPECT_TRUE(kind_of("x.SCAD", files).is_scene);
  EXPECT_FALSE(kind_of("x.off", files).is_scene);
  files.format = MeshFormat::kStl;
  EXPECT_FALSE(kind_of("x.csg", files).is_scene);
  EXPECT_EQ(kind_of("x.off", files).format, MeshFormat::kStl);
  files.files.emplace_back("-");  // then the format is of standard input
  EXPECT_EQ(kind_of("x.off", files).format, MeshFormat::kOff);
  EXPECT_EQ(kind_of("-", files).format, MeshFormat::kStl);
}

TEST(DescribedEdge, IsUsedOnceOrAFewTimes) {
  const UnbalancedEdge once{{0, 0, 0}, {0, 0, 1}, 7, 1, 0};
  EXPECT_EQ(describe(once),
            "the edge from (0, 0, 0) to (0, 0, 1) of face 7 is used once in this direction and 0 "
            "times in the other");
  const UnbalancedEdge often{{0, 0, 0}, {0, 0, 1}, 7, 3, 1};
  EXPECT_NE(describe(often).find("is used 3 times in this direction and once in the other"),
            std::string::npos);
}

}  // namespace
}  // namespace strata::csg
