#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "exact/flat_predicates.h"

namespace strata {

/// Triangles in the plane that know their neighbours, and that are made Delaunay by flips as points
/// are added.
///
/// A Side says what lies across an edge: a half-edge 3 t + k of triangle t, from its corner k to
/// the next one; a link of the front at which the mesh still grows; or an edge of the outline.
///
/// This work is based on: C. L. Lawson, "Software for C1 surface interpolation", 1977. We differ:
/// where four points are on one circle, the diagonal with the first of them is taken. That is the
/// limit of lowering the points on the paraboloid, the first one most, so the triangulation is
/// unique, and depends on the order of the points and the outline alone.
class DelaunayMesh {
 public:
  using Side = std::uint32_t;
  static constexpr Side link(std::uint32_t number) { return kLink | number; }
  static constexpr Side outline(std::uint32_t edge) { return kOutline | edge; }
  static constexpr bool is_half_edge(Side side) { return side < kLink; }
  static constexpr bool is_outline(Side side) { return side >= kOutline; }
  static constexpr std::uint32_t number(Side side) { return side & 0x3fffffffu; }
  /// Points and edges that a mesh can have: their numbers, those of links and of half-edges fit.
  static constexpr std::size_t kMostPoints = std::size_t{1} << 27;

  /// @param points  coordinates differ by at most 2^53; borrowed
  void begin(std::span<const exact::FlatPoint> points);
  std::size_t triangle_count() const { return corners_.size(); }
  const std::array<std::uint32_t, 3>& triangle(std::size_t t) const { return corners_[t]; }
  Side across(Side half_edge) const { return across_[half_edge]; }
  Side beneath(std::uint32_t link) const { return beneath_[link]; }

  std::uint32_t add_link() {
    beneath_.push_back(kOutline);
    return static_cast<std::uint32_t>(beneath_.size() - 1);
  }
  std::uint32_t add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    corners_.push_back({a, b, c});
    across_.insert(across_.end(), 3, kOutline);
    return static_cast<std::uint32_t>(corners_.size() - 1);
  }
  /// Puts two sides opposite each other.
  void join(Side a, Side b) {
    set(a, b);
    set(b, a);
  }
  /// Makes legalize() look at an edge that a new point sees.
  /// @param half_edge  of the triangle that the point makes with the edge
  void suspect(Side half_edge) { waiting_.push_back(half_edge); }
  /// Flips suspected edges, and those that the point sees then, until all are locally Delaunay, if
  /// they were so without the point. @pre all triangles turn left
  void legalize();
  /// Flips all edges where that makes triangles turn left, or Delaunay: for triangles of which
  /// rounding turned some over. @return how many do not turn left in the end
  std::size_t straighten();

 private:
  static constexpr Side kLink = 0x80000000u, kOutline = 0xc0000000u;

  // The quadrilateral around a half-edge from a to c: d on its left, b on its right.
  struct Quad {
    std::uint32_t a, b, c, d;
  };
  static Side next(Side half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
  std::uint32_t start(Side half_edge) const { return corners_[half_edge / 3][half_edge % 3]; }
  void set(Side at, Side value) {
    if (is_half_edge(at)) {
      across_[at] = value;
    } else if (!is_outline(at)) {
      beneath_[number(at)] = value;
    }
  }
  Quad quad(Side half_edge) const {
    const Side after = next(half_edge), other = across_[half_edge];
    return {start(half_edge), start(next(next(other))), start(after), start(next(after))};
  }
  bool delaunay(const Quad& quad) const;
  void flip(Side half_edge, const Quad& quad);
  int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return exact::orient2d(points_[a], points_[b], points_[c]);
  }

  std::span<const exact::FlatPoint> points_;
  std::vector<exact::filters::RealFlat> real_;  // the points about the first one; exact
  std::vector<std::array<std::uint32_t, 3>> corners_;
  std::vector<Side> across_;   // of the half-edges
  std::vector<Side> beneath_;  // of the links: the half-edge of the mesh, on their left
  std::vector<Side> waiting_;
};

}  // namespace strata
