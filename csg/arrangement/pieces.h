#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/arrangement/cut_lines.h"

namespace strata::csg {

/// A triangle at an atomic edge.
struct EdgeUse {
  static constexpr std::uint8_t kInside = 3;
  static constexpr std::uint32_t kNoPiece = 0xffffffffu;

  std::uint32_t triangle;
  std::uint32_t line;  ///< that the edge is a part of
  /// The pieces of the triangle on the left and on the right of the edge from a to b, as seen from
  /// the front of the triangle; none where the triangle ends at the edge.
  std::uint32_t left = kNoPiece, right = kNoPiece;
  std::uint8_t side;  ///< of the triangle that the edge lies along, or kInside
  bool forward;       ///< whether the line runs from a to b
};

/// An edge of the arrangement: nothing meets it but at its ends.
struct AtomicEdge {
  std::uint32_t a, b;  ///< points, a < b
  std::uint32_t first_use, use_count;
};

/// The pieces into which lines cut the triangles. A piece is a closed chain of edges with the
/// triangle on their left; where a piece has holes, each of its chains counts as a piece.
struct Pieces {
  std::vector<AtomicEdge> edges;  ///< all that more than two triangles may share, or where a
                                  ///< triangle is cut
  std::vector<EdgeUse> uses;
  std::vector<bool> edge_listed;  ///< of mesh edges: whether its parts are in `edges`
  /// The triangle of each piece. A triangle that is not cut is the piece of its own number; so is
  /// the first piece of a triangle that is cut.
  std::vector<std::uint32_t> triangle_of;
  /// Of each piece, whether it reaches out of the zone: no use and no edge refers to it. Empty
  /// where the zone is everywhere.
  std::vector<std::uint8_t> dead;

  bool is_dead(std::uint32_t piece) const { return !dead.empty() && dead[piece] != 0; }
};

/// Where the zone is not everywhere, edges that reach out of it are dropped, and so are the pieces
/// at them. At each of its other edges such a piece is a piece of its own: what lies on its two
/// sides is known there alone.
/// @return kCancelled, kLimit
Result<Pieces> find_pieces(const ArrangementInput& input, const BoundaryPoints& points,
                           const CutLines& lines, const SortedLines& sorted,
                           const Execution& execution);

}  // namespace strata::csg
