#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "exact/cut_points.h"

namespace strata {

using TriangleCorners = std::array<exact::FilePoint, 3>;

/// The set of points that two triangles share.
enum class Meeting : std::uint8_t {
  kDisjoint,      ///< no point
  kSharedVertex,  ///< one point, a vertex of both
  kSharedEdge,    ///< a segment, an edge of both
  kTouch,         ///< another point or segment; neither triangle passes through the other
  kCross,         ///< a segment; each triangle has vertices on both sides of the other's plane
  kOverlap,       ///< an area of their common plane
};

/// Whether a mesh may have two such triangles: they meet in vertices and edges of both, if at all.
constexpr bool is_clean(Meeting meeting) { return meeting <= Meeting::kSharedEdge; }

/// Exact. Vertices are one if their positions are. A triangle without area is the segment or point
/// that its vertices span; its vertices and the segments between them count as such, and it touches
/// at most. Orientation means nothing.
/// @pre coordinates differ by at most 2^53
Meeting triangles_meet(const TriangleCorners& a, const TriangleCorners& b);

/// A point that two triangles share, away from the ends of what they share; computed in double.
/// @pre they are not disjoint
glm::dvec3 meeting_place(const TriangleCorners& a, const TriangleCorners& b);

}  // namespace strata
