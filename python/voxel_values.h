#pragma once

#include "python/data.h"
#include "strata/csg/solid_lists.h"
#include "strata/voxelize/voxelize.h"

// What voxels hold beyond solid or not: colours and signed distances.

namespace strata::python {

/// Gives voxels of a mesh the colours of the nearest points of its surface.
/// @param soup  the mesh's, or what it was clamped to
Result<void> colour_of_mesh(const MeshData& mesh, const TriangleSoup& soup, bool solid,
                            const std::optional<glm::u8vec3>& inside, VoxelsData& voxels,
                            const Execution& execution);
/// Gives voxels that are labelled by csg::colour_labels() the colours of their solids.
Result<void> colour_of_solids(std::span<const glm::vec4> colours, VoxelsData& voxels,
                              const Execution& execution);

/// Signed distances to a surface, and the voxels inside. @param band  in voxels; 0: everywhere
/// @param surface  null: `soup`
Result<void> distances(const TriangleSoup& soup, const VoxelGrid& grid,
                       const VoxelizeOptions& options, const TriangleSoup* surface, double band,
                       VoxelsData& voxels, const Execution& execution);

}  // namespace strata::python
