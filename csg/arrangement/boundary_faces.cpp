#include "csg/arrangement/boundary_faces.h"

#include "exact/directions.h"

namespace strata::csg {

// The heights of one edge over the other in a projection in which their plane has area.
exact::EdgePoint BoundaryPoints::edge_edge(const Recipe& recipe) const {
  const auto& from = recipe.from;
  const exact::LatticePoint &p = vertices_[from[0]], &q = vertices_[from[1]],
                            &r = vertices_[from[2]], &s = vertices_[from[3]];
  const exact::LatticePoint along = q - p, other = s - r;
  const auto turn = [](const exact::LatticePoint& a, const exact::LatticePoint& b, int u, int v) {
    return std::int64_t{a[u]} * b[v] - std::int64_t{a[v]} * b[u];
  };
  int u = 0, v = 1;
  if (turn(along, other, 0, 1) == 0) {
    u = turn(along, other, 1, 2) != 0 ? 1 : 2;
    v = (u + 1) % 3;
  }
  return {p, q, turn(p - r, other, u, v), turn(q - r, other, u, v)};
}

exact::RationalPoint BoundaryPoints::rational(const Recipe& recipe) const {
  const auto& [kind, from] = recipe;
  switch (kind) {
    case Kind::kLattice:
      break;
    case Kind::kEdgePlane:
      return exact::rational(edge_plane(recipe));
    case Kind::kThreePlanes:
      return exact::rational(plane_of(from[0]), plane_of(from[1]), plane_of(from[2]));
    case Kind::kEdgeEdge:
      return exact::rational(edge_edge(recipe));
  }
  return exact::rational(vertices_[from[0]]);
}

}  // namespace strata::csg
