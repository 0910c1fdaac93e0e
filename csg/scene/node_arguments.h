#pragma once

#include <string_view>

#include "csg/outline/segments.h"
#include "csg/scene/csg_parser.h"

namespace strata::csg {

/// The arguments of a call, by name or by position. Of several with one name the last counts.
class NodeArguments {
 public:
  NodeArguments(const Ast& ast, const AstNode& node) : ast_(&ast), node_(&node) {}

  [[nodiscard]] ValueRef find(std::string_view name) const;
  /// By name, or the argument without a name at `position` (counted among those, from 0).
  [[nodiscard]] ValueRef find(std::string_view name, std::uint32_t position) const;

  [[nodiscard]] double number(std::string_view name, double otherwise) const {
    return find(name).number(otherwise);
  }
  [[nodiscard]] bool truth(std::string_view name, bool otherwise) const {
    return find(name).truth(otherwise);
  }
  /// $fn, $fa and $fs.
  [[nodiscard]] Segments segments(bool round_up) const;

 private:
  const Ast* ast_;
  const AstNode* node_;
};

}  // namespace strata::csg
