#pragma once

#include <string>

#include "strata/core/grid.h"
#include "strata/voxelize/output/voxel_output.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// The header of a NRRD file, version 4 (Kindlmann, teem.sourceforge.net/nrrd/format.html).
/// (Internal to voxelize/.)
/// @param data_file  of a detached header: the voxels as they are; empty: attached, gzip
[[nodiscard]] std::string nrrd_text(const VoxelGrid& grid, const VoxelWriterOptions& options,
                                    const DenseValues& values, const std::string& data_file);

}  // namespace strata
