#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/boundary_faces.h"
#include "csg/arrangement/cut_lines.h"

namespace strata::csg {

/// The edges of faces while they are collected, in no order.
struct FaceEdges {
  struct Edge {
    std::uint32_t triangle;  ///< whose plane the face lies in
    bool turned;             ///< the outside is behind the triangle
    std::uint32_t label;
    std::uint32_t from, to;  ///< points, with the face on the left as seen from outside
    std::uint32_t wedge;     ///< as BoundaryEdge::wedge
    std::uint32_t line;      ///< that it is a part of
  };
  struct InnerPoint {
    std::uint32_t triangle, point;
  };

  std::vector<Edge> edges;
  std::vector<BoundaryFaces::Whole> wholes;
  std::vector<InnerPoint> inner_points;  ///< that may lie within faces of a triangle's plane
  /// Of each triangle, a triangle that stands for its plane. Not all triangles of a plane have the
  /// same; those of one face do.
  std::vector<std::uint32_t> plane_of;
};

/// Sorts edges by planes, and drops points where nothing but one straight line passes.
BoundaryFaces join_face_edges(const ArrangementInput& input, const BoundaryPoints& points,
                              const CutLines& lines, FaceEdges edges);

}  // namespace strata::csg
