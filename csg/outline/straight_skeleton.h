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

/// The faces that the edges of a region sweep while all of them move inwards at speed 1, with time
/// as z: the roof of slope 45 degrees.
struct StraightSkeleton {
  std::vector<glm::dvec3> nodes;
  /// For each edge the directed boundary of its face, as pairs of nodes in any order. Level faces
  /// between the edges' faces are in `flats`.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> faces;
  /// Level triangles where a part of the region stopped moving.
  std::vector<glm::uvec3> flats;
};

/// Noise that moves the points before the simulation, which separates events that coincide. The
/// base of the roof stays exact.
struct Jitter {
  double distance = 0;     ///< greatest displacement along x and along y
  std::uint32_t seed = 1;  ///< selects the displacements
};

/// Simulates the wavefront: O. Aichholzer, F. Aurenhammer, D. Alberts and B. Gaertner, "A novel
/// type of skeleton for polygons", 1995. Time grows with points^2 times reflex corners; outlines
/// for which this product exceeds 3e9 are refused.
/// @param outline  one outer contour and its holes, clean
/// @param corner_steps  number of edges without length that a reflex corner gets for a full turn.
/// They bring the skeleton close to the medial axis (M. Tanase and R. Veltkamp, "A straight
/// skeleton approximating the medial axis", 2004); 0: none
/// @return kGeometry: too many points, or the simulation did not end
Result<StraightSkeleton> straight_skeleton(const Outline& outline, int corner_steps,
                                           const Jitter& jitter);

}  // namespace strata::csg
