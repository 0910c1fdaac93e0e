#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "csg/scene/csg_parser.h"
#include "csg/scene/scene.h"
#include "tests/fuzz/mesh_fuzzing.h"

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
  // Files would be those of the machine, and round things of a million segments take long.
  for (const csg::AstNode& node : ast->nodes) {
    if (node.name == "import" || node.name == "surface" || node.name == "text") return 0;
    for (std::uint32_t i = 0; i < node.argument_count; ++i) {
      const csg::AstArgument& argument = ast->arguments[node.first_argument + i];
      if (argument.name == "file") return 0;
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
  const auto scene = csg::parse_scene(text, "input", {}, execution);
  if (!scene) {
    must(scene.error().code == ErrorCode::kInput || scene.error().code == ErrorCode::kLimit,
         "a refusal is kInput or kLimit");
    return 0;
  }
  check_scene(*scene);
  return 0;
}
