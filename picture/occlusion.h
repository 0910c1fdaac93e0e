#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/execution.h"

// How much of its surroundings each visible point sees: ambient occlusion from one layer of depth.

namespace strata {

/// The visible points of a picture in eye space: x right, y up, z towards the eye.
struct EyeSurfaces {
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels
  bool perspective = true;
  double scale = 1.0;          ///< pixels a world unit; of a perspective view, at distance 1
  glm::dvec2 centre{0.0};      ///< where the view axis meets the picture, in pixels
  double origin_distance = 0;  ///< of the origin of `positions`, along the view axis
  /// Relative to a point on the view axis, so that floats suffice. kNowhere: nothing is seen.
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;  ///< of the faces, of length 1, towards the eye

  static constexpr glm::vec3 kNowhere{0.0f, 0.0f, -3e18f};
  void resize(int columns, int rows);
};

/// For each pixel the part of its surroundings, weighted by the cosine, that no visible surface
/// within `radius` (world units) is in the way of: 255 all, 0 nothing. A surface counts the less
/// the farther it is; what rises from a face by less than 5 degrees does not, so a plane sees all,
/// exactly, and facets of a curved surface do not darken each other.
[[nodiscard]] std::vector<std::uint8_t> openness(const EyeSurfaces& surfaces, double radius,
                                                 const Execution& execution = {});

}  // namespace strata
