#pragma once

#include <cstdint>

#include "strata/core/execution.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {

/// How large a voxel file will be.
struct FileSize {
  std::uint64_t bytes = 0;
  bool exact = false;  ///< false: it is not larger than that
};

/// The size of a file, before any voxel is made. Of formats that write runs or blocks the size
/// depends on the surface: the triangles are looked at, one by one, and give a bound.
/// @param factors  mesh, axis, votes, solid, surface and format are used
/// @param closed   every ray leaves the solid as often as it enters it
[[nodiscard]] FileSize file_size(const VoxelGrid& grid, const MemoryFactors& factors, bool closed,
                                 const VoxelWriterOptions& file, const Execution& execution);

}  // namespace strata::apps
