#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "csg/scene/csg_parser.h"
#include "mesh/text/input_bytes.h"
#include "tests/csg/scene/scene_checks.h"
#include "tests/support/corpus.h"

namespace strata::csg {
namespace {

using testkit::CorpusScene;
using testkit::kNoScenes;
using testkit::scene_files;

/// Scenes that are no scenes, and what is said about them: old dumps of other forms.
const std::map<std::string, std::string> kRefused = {
    {"example025", "expected a value, not 'round'"}};

bool is_solid_name(std::string_view name) {
  for (const char* solid : {"cube", "sphere", "cylinder", "polyhedron", "surface", "linear_extrude",
                            "rotate_extrude", "import"}) {
    if (name == solid) return true;
  }
  return false;
}

/// What the evaluator promises of every tree: operands come before their node, and have one.
void expect_tree(const Tree& tree) {
  EXPECT_NE(tree.root(), Tree::kNone);
  std::vector<int> taken(tree.nodes().size(), 0);
  for (Tree::NodeId id = 0; id < tree.nodes().size(); ++id) {
    if (tree.nodes()[id].operation == Operation::kSolid) continue;
    for (const Tree::NodeId operand : tree.operands(id)) {
      EXPECT_LT(operand, id);
      EXPECT_EQ(++taken[operand], 1);
    }
  }
}

// That they look as OpenSCAD's tests expect, apps.strata.ExpectedPictures holds.
TEST(SceneCorpus, EveryFileIsReadAndAlmostAllIsDone) {
  const std::vector<CorpusScene>& scenes = scene_files();
  if (scenes.empty()) GTEST_SKIP() << kNoScenes;
  EXPECT_GE(scenes.size(), 200u);
  std::map<std::string, int> kinds;  // of warnings
  int solid = 0, done = 0;
  for (const CorpusScene& entry : scenes) {
    SCOPED_TRACE(entry.name);
    const std::string file = entry.file.string();
    const auto bytes = detail::InputBytes::open(file, 0);
    ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
    const auto ast = parse_csg(bytes->view(), file);
    ReadSceneOptions options;
    options.asset_folder = entry.assets.string();
    const auto scene = read_scene(file, options);
    if (const auto known = kRefused.find(entry.name); known != kRefused.end()) {
      ASSERT_FALSE(ast.has_value() || scene.has_value()) << "can be read now";
      EXPECT_NE(scene.error().message.find(known->second), std::string::npos);
      continue;
    }
    ASSERT_TRUE(ast.has_value()) << ast.error().message;
    ASSERT_TRUE(scene.has_value()) << scene.error().message;
    bool all_done = true;
    for (const SceneWarning& warning : scene->warnings) {
      ++kinds[warning.code];
      all_done = all_done && warning.code != "not-done";
      EXPECT_TRUE(warning.message.starts_with(file + ":")) << warning.message;
    }
    if (std::none_of(ast->nodes.begin(), ast->nodes.end(),
                     [](const AstNode& node) { return is_solid_name(node.name); })) {
      continue;
    }
    ++solid;
    done += all_done ? 1 : 0;
    expect_tree(scene->tree);
  }
  for (const auto& [code, count] : kinds) RecordProperty(code, count);
  EXPECT_GE(solid, 100);
  EXPECT_GE(done, 0.97 * solid) << "of " << solid << " files with solids";
}

TEST(SceneCorpus, TruncatedFilesAreReadOrRefused) {
  const std::vector<CorpusScene>& scenes = scene_files();
  if (scenes.empty()) GTEST_SKIP() << kNoScenes;
  int refused = 0;
  for (std::size_t i = 0; i < scenes.size(); i += 3) {
    const auto bytes = detail::InputBytes::open(scenes[i].file.string(), 0);
    ASSERT_TRUE(bytes.has_value());
    for (std::size_t part = 1; part < 8; ++part) {
      const std::string text(bytes->view().substr(0, bytes->view().size() * part / 8));
      const auto ast = parse_csg(text, "part.csg");
      if (ast) continue;
      ++refused;
      EXPECT_EQ(ast.error().code, ErrorCode::kInput);
      EXPECT_TRUE(ast.error().message.starts_with("part.csg:")) << ast.error().message;
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace strata::csg
