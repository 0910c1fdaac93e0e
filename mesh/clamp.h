#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "strata/mesh/soup_tools.h"

namespace strata {

/// A mesh whose parts outside a box were moved onto the box's sides.
struct ClampedMesh {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> sources;  ///< the original triangle of each triangle
};

/// The image of a mesh under p -> clamp(p, box.low, box.high). Points inside the box stay where
/// they are, bit for bit; points outside move straight onto the box's sides. Triangles are cut
/// where the box bends them. Both sides of an edge are cut alike, so a closed mesh stays closed.
/// Around every point within the box the mesh winds as often as before: rays within the box meet
/// the same solid, however far the mesh reached out. Parts outside become sheets without volume on
/// the box's sides.
///
/// A cut between two ends that are far outside is rounded relative to their size (2^-52 of it).
/// Coordinates that both ends share are exact.
/// The result is incomplete after a stop request.
/// @param box  not empty
/// @pre coordinates are below kMostClamped
[[nodiscard]] ClampedMesh clamp_to_box(std::span<const glm::dvec3> positions,
                                       std::span<const glm::uvec3> triangles, const Bounds& box,
                                       const std::stop_token& stop = {});

inline constexpr double kMostClamped = 1e300;

}  // namespace strata
