#pragma once

#include <string>

#include "voxelize/output/writers.h"

namespace strata {

/// A .vdb of signed distances (internal to voxelize/). The volume of a voxel is one that OpenVDB
/// takes. @return kUsage unless voxels are cubes
VoxelWriterResult open_level_set_writer(const std::string& path, const VoxelGrid& grid,
                                        const VoxelWriterOptions& options);

}  // namespace strata
