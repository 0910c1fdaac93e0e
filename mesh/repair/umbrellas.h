#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// A half-edge of a triangle at an undirected edge that more than two faces share.
struct WedgeEdge {
  std::uint32_t triangle, corner;  ///< from this corner to the next one
  /// Not 0. The two triangles that bound the same inside of the solid have edges in opposite
  /// directions with the same number.
  std::uint32_t wedge;
};

/// Gives each fan of triangles around a point a vertex of its own, so that edges have two triangles
/// and the triangles at a vertex are one fan. Vertices are first the points, then the additional
/// ones; points without triangles are vertices without triangles.
/// @param triangles  of points; becomes triangles of vertices
/// @param wedges     where edges have more than two triangles: which of them belong together
/// @return the points of the additional vertices; an error (kInternal) when the triangles are not
/// the boundary of a solid, kCancelled
Result<std::vector<std::uint32_t>> split_umbrellas(std::vector<glm::uvec3>& triangles,
                                                   std::size_t point_count,
                                                   std::span<const WedgeEdge> wedges,
                                                   const Execution& execution = {});

}  // namespace strata
