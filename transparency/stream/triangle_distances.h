#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// The vertices of the frame's triangles in eye space, as the rasterizer has them.
[[nodiscard]] std::vector<glm::dvec3> eye_positions(const FrameTriangles& triangles);

/// The distance from the eye of a point in eye space: along the axis if the view is orthographic.
[[nodiscard]] double eye_distance(const View& view, const glm::dvec3& point);

/// The distances of each source triangle; 0 where nothing is left of it before the near plane.
struct TriangleDistances {
  std::vector<double> centroid, farthest;
};
/// @pre frame.triangles != nullptr
[[nodiscard]] TriangleDistances triangle_distances(const FrameInfo& frame);

/// The distances of each object's centroid; 0 where the object has no triangle.
[[nodiscard]] std::vector<double> object_distances(const FrameTriangles& triangles);

/// The rank of each element when all are sorted by `keys`, equal ones by their place.
/// @param comparisons  how many pairs were compared is added to it
[[nodiscard]] std::vector<std::uint32_t> ranks_of(const std::vector<double>& keys,
                                                  std::uint64_t& comparisons);

}  // namespace strata::transparency
