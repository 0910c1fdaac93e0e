#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace strata::csg {

/// A round face of a mesh, as its facets show it.
struct RoundFit {
  enum class Kind : std::uint8_t {
    kNone,      ///< neither of the others
    kFlat,      ///< the facets lie in a plane whose rim is no circle
    kCylinder,  ///< facets along an axis
    kSphere,
    kCircle  ///< the facets lie in a plane, and the rim next to the point is a circle
  };
  Kind kind = Kind::kNone;
  glm::dvec3 centre{0.0};  ///< of the sphere or circle; of a cylinder's axis, at half its length
  glm::dvec3 axis{0.0};    ///< of a cylinder or circle: of length 1, its largest part above 0
  double radius = 0.0;     ///< of the circle or sphere that the vertices lie on
  double length = 0.0;     ///< of a cylinder along its axis
  double span = 0.0;       ///< of a cylinder or circle: the angle around the axis, degrees to 360
  double deviation = 0.0;  ///< largest distance of a vertex from it
  bool hollow = false;     ///< the facets look towards the axis or centre
  std::size_t facets = 0;  ///< triangles that belong to it
};

/// Fits a cylinder, a sphere or a circle to the facets around one triangle of a mesh. Facets belong
/// together while the angle between neighbours is below 50 degrees and their vertices lie on the
/// surface: within a fiftieth of the height of a facet's chord, or within what six digits of a
/// coordinate leave. Five points around an axis are the least: any four may lie on a circle.
/// @param seed  the triangle; `at`: the point picked in it
RoundFit fit_round(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
                   std::uint32_t seed, const glm::dvec3& at);

}  // namespace strata::csg
