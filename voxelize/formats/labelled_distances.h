#pragma once

#include <memory>

#include "strata/voxelize/output/voxel_output.h"

namespace strata {

/// A writer of distances on one of labels: passes on the bits of floats as the labels of runs of
/// equal values (internal to voxelize/).
/// @param writer  of the same grid, opened for distances
std::unique_ptr<VoxelWriter> by_labels(std::unique_ptr<VoxelWriter> writer, const VoxelGrid& grid);

}  // namespace strata
