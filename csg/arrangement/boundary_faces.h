#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

#include "exact/cut_points.h"

namespace strata::csg {

/// The points of a boundary: lattice points, points of an edge and a plane, points of three planes.
/// A point has one index, whichever triangles meet there. The first vertices().size() points are
/// the vertices; all others are no vertices.
class BoundaryPoints {
 public:
  enum class Kind : std::uint8_t { kLattice, kEdgePlane, kEdgeEdge, kThreePlanes };
  /// How a point is made, of vertices() and triangles().
  struct Recipe {
    Kind kind = Kind::kLattice;
    /// kLattice: [vertex]; kEdgePlane: [vertex, vertex, triangle]; kEdgeEdge: [vertex, vertex,
    /// vertex, vertex] of two edges of one plane; kThreePlanes: [triangle, triangle, triangle].
    std::array<std::uint32_t, 4> from{};

    /// Of two edges, in any order.
    static Recipe of_edges(std::array<std::uint32_t, 2> a, std::array<std::uint32_t, 2> b) {
      if (a[0] > a[1]) std::swap(a[0], a[1]);
      if (b[0] > b[1]) std::swap(b[0], b[1]);
      if (b < a) std::swap(a, b);
      return {Kind::kEdgeEdge, {a[0], a[1], b[0], b[1]}};
    }
    friend bool operator==(const Recipe&, const Recipe&) = default;
  };

  BoundaryPoints() = default;
  BoundaryPoints(std::vector<exact::LatticePoint> vertices, std::vector<glm::uvec3> triangles)
      : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {}

  const std::vector<exact::LatticePoint>& vertices() const { return vertices_; }
  const std::vector<glm::uvec3>& triangles() const { return triangles_; }
  std::size_t size() const { return vertices_.size() + rounded_.size(); }
  /// Whether the point is one of vertices(): rounding moves nothing.
  bool on_lattice(std::uint32_t point) const { return point < vertices_.size(); }
  /// In 2^-24 step.
  exact::FilePoint rounded(std::uint32_t point) const {
    return on_lattice(point) ? exact::file_point(vertices_[point])
                             : rounded_[point - vertices_.size()];
  }
  Recipe recipe(std::uint32_t point) const {
    return on_lattice(point) ? Recipe{Kind::kLattice, {point}} : recipes_[point - vertices_.size()];
  }
  exact::Plane plane_of(std::uint32_t triangle) const {
    const glm::uvec3& t = triangles_[triangle];
    return exact::plane_through(vertices_[t.x], vertices_[t.y], vertices_[t.z]);
  }
  /// @pre the recipe is of kEdgePlane
  exact::EdgePoint edge_plane(const Recipe& recipe) const {
    return exact::edge_plane_point(vertices_[recipe.from[0]], vertices_[recipe.from[1]],
                                   plane_of(recipe.from[2]));
  }
  /// @pre the recipe is of kEdgeEdge
  exact::EdgePoint edge_edge(const Recipe& recipe) const;
  /// The point itself.
  exact::RationalPoint rational(std::uint32_t point) const { return rational(recipe(point)); }
  exact::RationalPoint rational(const Recipe& recipe) const;

  /// Whether rounding moves the point. Many points of parts with faces along the axes stay.
  bool moved(std::uint32_t point) const {
    return !on_lattice(point) && moved_[point - vertices_.size()];
  }

  std::uint32_t add(const Recipe& recipe, const exact::FilePoint& rounded, bool moved = true) {
    recipes_.push_back(recipe);
    rounded_.push_back(rounded);
    moved_.push_back(moved);
    return static_cast<std::uint32_t>(size() - 1);
  }

 private:
  std::vector<exact::LatticePoint> vertices_;
  std::vector<glm::uvec3> triangles_;
  std::vector<exact::FilePoint> rounded_;
  std::vector<Recipe> recipes_;
  std::vector<bool> moved_;
};

/// An edge of a face, with the face on its left as seen from outside of the solid.
struct BoundaryEdge {
  std::uint32_t from, to;  ///< points
  /// 0 where the undirected edge has two faces. Where it has more, the two faces that bound the
  /// same inside of the solid have edges in opposite directions with the same number.
  std::uint32_t wedge = 0;
};

/// All faces of one plane that have the same outside and the same label: polygons with holes, which
/// may touch each other and themselves in points. Their edges are the boundary of the region on
/// their left; none lies within the region.
struct BoundaryPlane {
  exact::Plane plane;  ///< its normal points to the outside of the solid
  std::uint32_t label = 0;
  std::uint32_t first_edge = 0, edge_count = 0;    ///< in edges
  std::uint32_t first_touch = 0, touch_count = 0;  ///< in touches
};

/// The exact boundary of a tree's result. Orders mean nothing.
struct BoundaryFaces {
  BoundaryPoints points;
  /// Triangles that nothing cuts and that lie in no plane with a neighbour: faces by themselves.
  struct Whole {
    glm::uvec3 points;  ///< counter-clockwise from outside
    std::uint32_t label = 0;
  };
  std::vector<Whole> wholes;  ///< each of their edges has two faces
  std::vector<BoundaryPlane> planes;
  std::vector<BoundaryEdge> edges;
  /// Points of a plane that are vertices of the mesh elsewhere: where they lie inside of a face,
  /// the solid touches itself, and the face must have a vertex. Others are to be ignored.
  std::vector<std::uint32_t> touches;
};

}  // namespace strata::csg
