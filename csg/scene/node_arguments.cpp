#include "csg/scene/node_arguments.h"

#include <span>

namespace strata::csg {

ValueRef NodeArguments::find(std::string_view name) const {
  for (std::uint32_t i = node_->argument_count; i-- > 0;) {
    const AstArgument& argument = ast_->arguments[node_->first_argument + i];
    if (argument.name == name) return {*ast_, argument.value};
  }
  return {};
}

ValueRef NodeArguments::find(std::string_view name, std::uint32_t position) const {
  const auto all = std::span(ast_->arguments).subspan(node_->first_argument, node_->argument_count);
  ValueRef found;
  for (const AstArgument& argument : all) {
    const bool here = argument.name.empty() && position-- == 0;
    if (!here && argument.name != name) continue;
    if (const ValueRef value(*ast_, argument.value); value.given()) found = value;
  }
  return found;
}

Segments NodeArguments::segments(bool round_up) const {
  Segments segments;
  segments.fn = number("$fn", segments.fn);
  segments.fa = number("$fa", segments.fa);
  segments.fs = number("$fs", segments.fs);
  segments.round_up = round_up;
  return segments;
}

}  // namespace strata::csg
