#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

namespace strata::csg {

/// A Boolean expression over files: names, operators, parentheses.
///
///   a + b   a | b   union            a - b   difference
///   a * b   a & b   intersection     a ^ b   in one of the two
///
/// `*` and `&` bind first; the others are done from left to right.
struct Expression {
  enum class Kind { kInput, kUnion, kIntersection, kDifference, kExclusive };
  struct Node {
    Kind kind = Kind::kInput;
    std::size_t input = 0;              ///< kInput: which file
    std::size_t first = 0, second = 0;  ///< else: the operands, which stand before the node
  };
  std::vector<Node> nodes;  ///< the last one is the whole
};

/// Most parentheses that may be open at once.
inline constexpr int kMaxExpressionDepth = 1000;

/// Reads an expression. A name is the stem of a file (`part` for `some/part.stl`) where exactly one
/// file has it, else a letter that says which file: a is the first, b the second.
/// @return kUsage with the place marked
Result<Expression> parse_expression(std::string_view text, const std::vector<std::string>& files);

}  // namespace strata::csg
