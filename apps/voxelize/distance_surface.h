#pragma once

#include <optional>

#include "apps/voxelize/voxelize_report.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/voxelize.h"

namespace strata::apps {

/// The faces that distances are measured to, where they are not those of the input: the exact
/// boundary of a scene or expression, and of closed meshes that overlap themselves or each other.
/// @param options  that the voxels inside are found with
Result<std::optional<TriangleSoup>> distance_surface(const VoxelizeCommand& command,
                                                     const VoxelizeOutcome& outcome,
                                                     const VoxelizeOptions& options,
                                                     Session& session);

}  // namespace strata::apps
