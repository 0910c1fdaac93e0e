#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

#include "csg/outline/outline.h"
#include "strata/core/result.h"

namespace strata::csg {

/// The faces that the edges of a region sweep when all of them move inwards at speed 1 and z is the
/// time: the roof of slope 45 degrees.
struct StraightSkeleton {
  std::vector<glm::dvec3> nodes;
  /// Of each edge: the directed boundary of its face, pairs of nodes in any order. What is left
  /// open between faces is closed by `flats`.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> faces;
  /// Level triangles where a region stopped moving.
  std::vector<glm::uvec3> flats;
};

/// Moves the points before they start, which parts events that fall together; the base stays exact.
struct Jitter {
  double distance = 0;     ///< along x and y at most
  std::uint32_t seed = 1;  ///< of the directions
};

/// O. Aichholzer, F. Aurenhammer, D. Alberts and B. Gaertner, "A novel type of skeleton for
/// polygons", 1995, by simulation of the wavefront.
/// @param outline  one outer contour and its holes, clean
/// @param corner_steps  edges without length put into a reflex corner for a full turn, which bring
/// the skeleton close to the medial axis (M. Tanase and R. Veltkamp, "A straight skeleton
/// approximating the medial axis", 2004); 0: none
/// Time grows with points^2 times reflex corners; outlines beyond 3e9 of these are refused.
/// @return kGeometry: too many points, or the simulation did not come to an end
Result<StraightSkeleton> straight_skeleton(const Outline& outline, int corner_steps,
                                           const Jitter& jitter);

}  // namespace strata::csg
