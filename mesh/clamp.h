#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "strata/mesh/soup_tools.h"

namespace strata {

/// A mesh whose outside was moved onto the sides of a box.
struct ClampedMesh {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> sources;  ///< the triangle of the mesh that each one is a piece of
};

/// The image of a mesh under p -> clamp(p, box.low, box.high): what lies in the box stays where it
/// is, bit for bit; what lies outside is moved straight onto the box's sides. Triangles are cut
/// where the box bends them. Both sides of an edge are cut alike, so a closed mesh stays closed,
/// and around every point within the box the mesh winds as often as before: rays within the box
/// meet the same solid, however far it reached out. Parts that lie outside become sheets without
/// volume on the box's sides.
///
/// Where both ends of an edge are far outside, the place of the cut is rounded like they are (2^-52
/// of their size), but for coordinates that both ends share, which are exact.
/// Cut short when a stop is asked for.
/// @param box not empty
/// @pre coordinates are below kMostClamped
[[nodiscard]] ClampedMesh clamp_to_box(std::span<const glm::dvec3> positions,
                                       std::span<const glm::uvec3> triangles, const Bounds& box,
                                       const std::stop_token& stop = {});

inline constexpr double kMostClamped = 1e300;

}  // namespace strata
