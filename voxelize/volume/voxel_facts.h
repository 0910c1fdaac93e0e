#pragma once

#include <string>
#include <utility>
#include <vector>

#include "strata/voxelize/volume/voxel_volume.h"

namespace strata {

/// What a user asks first of a file of voxels, as rows of a table: for `strata info` and the
/// window.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> voxel_facts(
    const VoxelVolume& volume);

}  // namespace strata
