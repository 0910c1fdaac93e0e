#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "csg/scene/csg_parser.h"
#include "mesh/formats/input_bytes.h"
#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

namespace fs = std::filesystem;

const std::string kFolder = std::string(STRATA_SOURCE_DIR) + "/../shared/csg";

/// All .csg files of the corpus, sorted.
std::vector<std::string> corpus() {
  std::vector<std::string> files;
  std::error_code status;
  for (fs::recursive_directory_iterator at(kFolder, status), end; !status && at != end;
       at.increment(status)) {
    if (at->is_regular_file() && at->path().extension() == ".csg") files.push_back(at->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool is_solid_name(std::string_view name) {
  for (const char* solid : {"cube", "sphere", "cylinder", "polyhedron", "surface", "linear_extrude",
                            "rotate_extrude", "import"}) {
    if (name == solid) return true;
  }
  return false;
}

TEST(SceneCorpus, EveryFileIsReadAndAlmostAllIsDone) {
  const std::vector<std::string> files = corpus();
  if (files.empty()) GTEST_SKIP() << "no corpus: it is looked for in shared/csg beside the source";
  EXPECT_GE(files.size(), 427u);
  std::map<std::string, std::pair<int, int>> kinds;  // warnings, files
  int solid = 0, done = 0;
  for (const std::string& file : files) {
    const auto bytes = detail::InputBytes::open(file, 0);
    ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
    const auto ast = parse_csg(bytes->view(), file);
    ASSERT_TRUE(ast.has_value()) << ast.error().message;
    const auto scene = read_scene(file);
    ASSERT_TRUE(scene.has_value()) << scene.error().message;
    std::map<std::string, int> here;
    for (const SceneWarning& warning : scene->warnings) {
      ++here[warning.code];
      EXPECT_TRUE(warning.message.starts_with(file + ":")) << warning.message;
    }
    for (const auto& [code, count] : here) {
      kinds[code].first += count;
      ++kinds[code].second;
    }
    if (std::none_of(ast->nodes.begin(), ast->nodes.end(),
                     [](const AstNode& node) { return is_solid_name(node.name); })) {
      continue;
    }
    ++solid;
    done += here.count("not-done") == 0;
    // What the evaluator promises of every tree.
    EXPECT_NE(scene->tree.root(), Tree::kNone);
    std::vector<int> taken(scene->tree.nodes().size(), 0);
    for (Tree::NodeId id = 0; id < scene->tree.nodes().size(); ++id) {
      if (scene->tree.nodes()[id].operation == Operation::kSolid) continue;
      for (const Tree::NodeId operand : scene->tree.operands(id)) {
        EXPECT_LT(operand, id);
        EXPECT_EQ(++taken[operand], 1);
      }
    }
  }
  std::printf("%-14s %8s %6s\n", "warning", "warnings", "files");
  for (const auto& [code, count] : kinds) {
    std::printf("%-14s %8d %6d\n", code.c_str(), count.first, count.second);
  }
  std::printf("%d of %d files with solids are done\n", done, solid);
  EXPECT_GE(done, 0.97 * solid);
}

TEST(SceneCorpus, TruncatedFilesAreReadOrRefused) {
  const std::vector<std::string> files = corpus();
  if (files.empty()) GTEST_SKIP() << "no corpus: it is looked for in shared/csg beside the source";
  for (std::size_t i = 0; i < files.size(); i += 7) {
    const auto bytes = detail::InputBytes::open(files[i], 0);
    ASSERT_TRUE(bytes.has_value());
    for (std::size_t part = 1; part < 8; ++part) {
      const std::string text(bytes->view().substr(0, bytes->view().size() * part / 8));
      const auto ast = parse_csg(text, "part.csg");
      if (!ast) {
        EXPECT_TRUE(ast.error().message.starts_with("part.csg:")) << ast.error().message;
      }
    }
  }
}

}  // namespace
}  // namespace strata::csg
