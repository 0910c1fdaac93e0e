#pragma once

#include <string_view>

#include "csg/outline/segments.h"
#include "csg/scene/csg_parser.h"

namespace strata::csg {

/// The arguments of a call, by name or by position. If a name is repeated, the last argument
/// counts.
class NodeArguments {
 public:
  NodeArguments(const Ast& ast, const AstNode& node) : ast_(&ast), node_(&node) {}

  [[nodiscard]] ValueRef find(std::string_view name) const;
  /// The argument of this name, else the unnamed argument at `position`, counted from 0 among
  /// unnamed ones.
  [[nodiscard]] ValueRef find(std::string_view name, std::uint32_t position) const;

  [[nodiscard]] double number(std::string_view name, double otherwise) const {
    return find(name).number(otherwise);
  }
  [[nodiscard]] bool truth(std::string_view name, bool otherwise) const {
    return find(name).truth(otherwise);
  }
  /// Reads $fn, $fa and $fs.
  [[nodiscard]] Segments segments(bool round_up) const;

 private:
  const Ast* ast_;
  const AstNode* node_;
};

}  // namespace strata::csg
