#pragma once

#include <cstdint>
#include <string>

#include "core/disk_room.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// check_room() for a file of all voxels of a grid, not packed. (Internal to voxelize/.)
/// @param head  bytes of the file before them
[[nodiscard]] inline Result<void> check_dense_room(const std::string& path, const glm::ivec3& dims,
                                                   const DenseValues& values,
                                                   std::uint64_t head = 0) {
  const std::uint64_t voxels = static_cast<std::uint64_t>(dims.x) *
                               static_cast<std::uint64_t>(dims.y) *
                               static_cast<std::uint64_t>(dims.z);
  return check_room(path, head + voxels * values.bytes);
}

}  // namespace strata
