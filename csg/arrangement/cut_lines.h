#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/arrangement/candidate_pairs.h"
#include "csg/arrangement/point_table.h"
#include "csg/arrangement/welded_solids.h"
#include "exact/determinants.h"

namespace strata::csg {

/// How a line runs: the coordinate that changes most along it, and whether it rises.
struct LineAxis {
  int axis;
  bool rising;
};
/// @pre the direction is not zero
LineAxis axis_of(const exact::Cross& direction);

/// Where two triangles cross: the piece of the line of their planes that both contain, from one
/// point to the other in the direction cross(n_first, n_second).
struct CrossingLine {
  std::uint32_t first, second;  ///< triangles
  std::uint32_t from, to;       ///< points
  LineAxis axis;
};

/// The lines that cut triangles. A *line* is a mesh edge or a CrossingLine; its number is that of
/// the edge, or edge count + index of the crossing line. All triangles that a line lies in refer to
/// it by this number, so that they are cut at the same points.
struct CutLines {
  /// A piece of a line that lies in a triangle and not along its sides.
  struct Cut {
    std::uint32_t triangle, line;
    std::uint32_t from, to;  ///< points of the line
  };
  /// A point within a triangle where a corner or an edge of another touches it.
  struct Contact {
    std::uint32_t triangle, point;
  };
  struct LinePoint {
    std::uint32_t line, point;
  };

  std::vector<CrossingLine> crossings;
  std::vector<Cut> cuts;
  std::vector<Contact> contacts;
  std::vector<LinePoint> line_points;  ///< not the ends; unsorted, some several times
  std::vector<bool> touched;           ///< of mesh edges: other triangles contain a piece of it
};

/// What all steps of an arrangement share.
struct ArrangementInput {
  const std::vector<exact::LatticePoint>& vertices;
  const std::vector<glm::uvec3>& triangles;
  const WeldedSolids& solids;  ///< their contents; vertices and triangles have moved out
  const MeshEdges& edges;
  const LiveZone& zone;  ///< where the arrangement is wanted; elsewhere cuts may be missing

  exact::Plane plane_of(std::uint32_t triangle) const {
    const glm::uvec3& t = triangles[triangle];
    return exact::plane_through(vertices[t.x], vertices[t.y], vertices[t.z]);
  }
  std::uint32_t edge_from(std::uint32_t edge) const { return corner(edges.uses_of(edge)[0], 0); }
  std::uint32_t edge_to(std::uint32_t edge) const { return corner(edges.uses_of(edge)[0], 1); }
  std::uint32_t corner(std::uint32_t use, std::uint32_t next) const {
    return corner_of(triangles, use, next);
  }
};

LineAxis axis_of(const ArrangementInput& input, const CutLines& lines, std::uint32_t line);
/// The direction in which a line runs.
exact::Cross direction_of(const ArrangementInput& input, const CutLines& lines, std::uint32_t line);

/// What one thread finds. Numbers of points and lines from kOwn on are those of its own.
struct CutLinesPart : CutLines {
  static constexpr std::uint32_t kOwn = 0x80000000u;

  std::vector<NewPoint> points;
  std::vector<std::uint32_t> touched_edges;

  std::uint32_t add_point(const BoundaryPoints& known, const BoundaryPoints::Recipe& recipe) {
    points.push_back(make_point(known, recipe));
    return kOwn + static_cast<std::uint32_t>(points.size() - 1);
  }
};
/// Appends what threads found, in the order of the parts.
void join_parts(const ArrangementInput& input, std::vector<CutLinesPart> parts, PointTable& points,
                CutLines& lines);

/// Finds where pairs of triangles meet. @return kCancelled
Result<void> meet_pairs(const ArrangementInput& input, std::span<const BoxPair> pairs,
                        PointTable& points, CutLines& lines, const Execution& execution);

/// Finds where lines meet within a triangle, for all triangles. Points are added to the lines.
/// @return kCancelled
Result<void> cross_lines(const ArrangementInput& input, PointTable& points, CutLines& lines,
                         const Execution& execution);

/// The points of each line that has any, in order along it, ends included.
struct SortedLines {
  std::vector<std::uint32_t> first;  ///< of each line; one more than lines
  std::vector<std::uint32_t> points;

  /// Empty for a mesh edge that nothing touches.
  std::span<const std::uint32_t> of(std::uint32_t line) const {
    return std::span(points).subspan(first[line], first[line + 1] - first[line]);
  }
};

SortedLines sort_lines(const ArrangementInput& input, const BoundaryPoints& points,
                       const CutLines& lines);

}  // namespace strata::csg
