#pragma once

#include <glm/vec3.hpp>

#include "strata/voxelize/intervals.h"

namespace strata {

/// The slope of a set at a point: the gradient of its occupancy (1 in solid voxels, 0 elsewhere),
/// blurred by a bump 3 voxels in radius. It points into the set. Integrated exactly over the runs
/// of the columns around the point.
/// @param point  in voxels, along x, y, z
[[nodiscard]] glm::dvec3 occupancy_slope(const VoxelIntervals& set, const glm::dvec3& point);

}  // namespace strata
