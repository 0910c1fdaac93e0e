#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"

// Normals of curved surfaces that are given as triangles. Private to csg/.

namespace strata::csg {

/// A normal of each corner of the triangles of a mesh.
class CornerNormals {
 public:
  /// Faces that meet at an edge with less than `crease` degrees between their normals are parts of
  /// one smooth surface; around a vertex the normals of those that are connected by such edges are
  /// averaged, each weighted by its angle there. Vertices at exactly the same position are one.
  /// Time in proportion to the triangles. @param execution  threads; a stop leaves some faces flat
  CornerNormals(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
                double crease, const Execution& execution);

  /// Whether the corners of a triangle have the normal of its face.
  [[nodiscard]] bool flat(std::uint32_t triangle) const {
    return packed_.empty() || packed_[std::size_t{triangle} * 3] == kFlat;
  }
  /// Of length 1. @pre !flat(triangle)
  [[nodiscard]] glm::dvec3 at(std::uint32_t triangle, int corner) const {
    return unpack(packed_[std::size_t{triangle} * 3 + static_cast<std::size_t>(corner)]);
  }

  /// A unit vector in 32 bits, as a point of an octahedron: off by less than 1e-4.
  [[nodiscard]] static std::uint32_t pack(const glm::dvec3& unit);
  [[nodiscard]] static glm::dvec3 unpack(std::uint32_t packed);

 private:
  static constexpr std::uint32_t kFlat = 0xffffffffu;  ///< pack() does not make it

  std::vector<std::uint32_t> packed_;  ///< of each corner; empty: all are flat
};

}  // namespace strata::csg
