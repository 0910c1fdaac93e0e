#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/boundary_faces.h"

namespace strata::csg {

/// A point that a thread found; it may be known already.
struct NewPoint {
  BoundaryPoints::Recipe recipe;
  exact::FilePoint rounded;
  bool moved;
};
NewPoint make_point(const BoundaryPoints& points, const BoundaryPoints::Recipe& recipe);

/// Finds points by where they are, so that a point has one index however it is made. Points that
/// are equal are rounded alike: a hash table over rounded points holds few candidates, which are
/// compared exactly.
class PointTable {
 public:
  explicit PointTable(BoundaryPoints points);

  /// Lets a vertex be found.
  void insert_vertex(std::uint32_t vertex);
  /// Makes room for points to come.
  void reserve(std::size_t points);
  /// The point that a recipe makes.
  std::uint32_t find_or_add(const NewPoint& point);

  /// No more points are looked for.
  void stop_finding() {
    slots_ = {};
    inserted_ = {};
  }

  const BoundaryPoints& points() const { return points_; }
  BoundaryPoints take() { return std::move(points_); }

 private:
  std::size_t slot_of(const exact::FilePoint& rounded) const;
  void insert(std::uint32_t point);
  void grow(std::size_t slots);

  BoundaryPoints points_;
  std::vector<std::uint32_t> slots_;  // point + 1; 0: empty
  std::size_t used_ = 0;
  std::vector<bool> inserted_;  // of vertices
};

/// The order of two points along a coordinate axis: -1, 0, 1.
int order_along(const BoundaryPoints& points, std::uint32_t a, std::uint32_t b, int axis);

/// 1 above the plane, 0 on it, -1 below it.
int side_of(const BoundaryPoints& points, std::uint32_t point, const exact::Plane& plane);

}  // namespace strata::csg
