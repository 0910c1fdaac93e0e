#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "csg/scene/csg_parser.h"
#include "csg/scene/node_arguments.h"
#include "strata/csg/scene/scene.h"
#include "tests/csg/scene/zip_files.h"
#include "tests/fuzz/mesh_fuzzing.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

/// Preorder arrays: ends lie behind their nodes and inside those around.
void check_ast(const csg::Ast& ast) {
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < ast.nodes.size(); ++i) {
    const csg::AstNode& node = ast.nodes[i];
    while (!open.empty() && open.back() <= i) open.pop_back();
    must(node.end > i && node.end <= ast.nodes.size(), "a subtree ends after its node");
    must(open.empty() || node.end <= open.back(), "subtrees nest");
    must(node.offset < ast.text.size(), "a node has a place");
    must(node.first_argument + node.argument_count <= ast.arguments.size(), "arguments are there");
    open.push_back(node.end);
  }
  for (std::uint32_t i = 0; i < ast.values.size(); ++i) {
    const csg::AstValue& value = ast.values[i];
    if (value.kind == csg::ValueKind::kList) {
      must(value.end > i && value.end <= ast.values.size(), "a list ends after its start");
    } else if (value.kind == csg::ValueKind::kString) {
      must(value.end < ast.strings.size(), "a string is there");
    }
  }
}

void check_scene(const csg::Scene& scene) {
  const csg::Tree& tree = scene.tree;
  must(tree.root() < tree.nodes().size(), "a scene has a root");
  for (csg::Tree::NodeId id = 0; id < tree.nodes().size(); ++id) {
    if (tree.nodes()[id].operation == csg::Operation::kSolid) continue;
    for (const csg::Tree::NodeId operand : tree.operands(id)) {
      must(operand < id, "operands stand before their node");
    }
  }
  for (const csg::Solid& solid : tree.solids()) {
    must(solid.mesh && !solid.mesh->triangles.empty(), "a solid has triangles");
    for (const glm::uvec3& t : solid.mesh->triangles) {
      const std::size_t count = solid.mesh->positions.size();
      must(t.x < count && t.y < count && t.z < count, "indices are in range");
    }
  }
  for (const csg::SceneWarning& warning : scene.warnings) {
    must(warning.message.starts_with("input"), "a warning names the file");
  }
}

/// Small files of each kind that a scene can import.
class Assets {
 public:
  Assets() {
    write("a.dxf", "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\nrim\n10\n1\n20\n2\n40\n3\n0\nEOF\n");
    write("a.svg", "<svg viewBox='0 0 9 9'><path id='p' d='M1 1h5v4z'/><path d='M0 0L9 9'/></svg>");
    write("a.dat", "1 2 3\n4 5 6\n");
    write("a.stl",
          "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n"
          "endloop\nendfacet\nendsolid\n");
    write("a.off", "OFF 4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    write("a.3mf",
          csg::zip_of({{"a.model",
                        "<model><resources><object id='1'><mesh><vertices><vertex x='0' y='0' "
                        "z='0'/><vertex x='1' y='0' z='0'/><vertex x='0' y='1' z='0'/></vertices>"
                        "<triangles><triangle v1='0' v2='1' v3='2'/></triangles></mesh></object>"
                        "</resources><build><item objectid='1'/></build></model>"}}));
  }
  [[nodiscard]] bool holds(std::string_view name) const {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
  }
  [[nodiscard]] bool all_ours(const csg::Ast& ast, const csg::AstNode& node) const {
    return holds(csg::NodeArguments(ast, node).find("file", 0).string());
  }
  [[nodiscard]] csg::ReadSceneOptions options() const {
    csg::ReadSceneOptions options;
    options.asset_folder = folder_.path().string();
    return options;
  }

 private:
  void write(const std::string& name, const std::string& bytes) {
    folder_.write(name, bytes);
    names_.push_back(name);
  }

  testkit::TemporaryFolder folder_;
  std::vector<std::string> names_;
};

bool is_short_text(const csg::Ast& ast, const csg::AstNode& node) {
  constexpr std::size_t kLongest = 100;
  return csg::NodeArguments(ast, node).find("text", 0).string().size() <= kLongest;
}

}  // namespace
}  // namespace strata

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto ast = csg::parse_csg(text, "input");
  if (!ast) {
    must(ast.error().code == ErrorCode::kInput, "a refusal is kInput");
    must(ast.error().message.starts_with("input:"), "a refusal names file and line");
    return 0;
  }
  check_ast(*ast);
  // Other files than ours would be those of the machine, and round things of a million segments
  // take long.
  static const Assets assets;
  for (const csg::AstNode& node : ast->nodes) {
    if (node.name == "text" && !is_short_text(*ast, node)) return 0;
    if ((node.name == "import" || node.name == "surface") && !assets.all_ours(*ast, node)) return 0;
    for (std::uint32_t i = 0; i < node.argument_count; ++i) {
      const csg::AstArgument& argument = ast->arguments[node.first_argument + i];
      if (argument.name == "file" && !assets.holds(csg::ValueRef(*ast, argument.value).string())) {
        return 0;
      }
      const double number = csg::ValueRef(*ast, argument.value).number(1.0);
      const bool detail = argument.name.starts_with("$f") || argument.name == "slices" ||
                          argument.name == "segments" || argument.name == "twist";
      const bool radius =
          argument.name.starts_with("r") || argument.name.starts_with("d") || argument.name.empty();
      if (detail && !(number >= 0.5 && number <= 50.0) && number != 0.0) return 0;
      if (radius && !(number <= 100.0)) return 0;
    }
  }
  if (ast->nodes.size() > 200) return 0;
  Execution execution;
  execution.threads = 1;
  const auto scene = csg::parse_scene(text, "input", assets.options(), execution);
  if (!scene) {
    must(scene.error().code == ErrorCode::kInput || scene.error().code == ErrorCode::kLimit,
         "a refusal is kInput or kLimit");
    return 0;
  }
  check_scene(*scene);
  return 0;
}
