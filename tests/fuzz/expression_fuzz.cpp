#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "csg/input/expression.h"
#include "tests/fuzz/mesh_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using strata::must;
  using strata::csg::Expression;
  const std::vector<std::string> files{"x/plate.stl", "hole.obj", "plate.csg", "my part.ply"};
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto expression = strata::csg::parse_expression(text, files);
  if (!expression) {
    must(expression.error().code == strata::ErrorCode::kUsage, "a refusal is kUsage");
    must(!expression.error().message.empty(), "a refusal says why");
    return 0;
  }
  must(!expression->nodes.empty(), "an expression has a node");
  std::vector<int> used(expression->nodes.size(), 0);
  for (std::size_t i = 0; i < expression->nodes.size(); ++i) {
    const Expression::Node& node = expression->nodes[i];
    if (node.kind == Expression::Kind::kInput) {
      must(node.input < files.size(), "an input is there");
      continue;
    }
    must(node.first < i && node.second < i, "operands stand before their node");
    ++used[node.first], ++used[node.second];
  }
  for (std::size_t i = 0; i + 1 < used.size(); ++i) must(used[i] == 1, "a node is used once");
  must(used.back() == 0, "the last node is the whole");
  return 0;
}
