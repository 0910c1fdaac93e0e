#pragma once

#include <cstdint>
#include <string_view>

#include "apps/strata/commands.h"
#include "apps/strata/mesh_input.h"
#include "strata/core/grid.h"

namespace strata::apps {

/// What a job is expected to hold at most, in bytes.
struct MemoryEstimate {
  std::uint64_t mesh = 0;    ///< triangles, positions, positions on the lattice
  std::uint64_t bins = 0;    ///< which triangles meet which tile
  std::uint64_t slabs = 0;   ///< intervals in flight, and tables of the threads
  std::uint64_t output = 0;  ///< what the format must hold until the end

  [[nodiscard]] std::uint64_t total() const { return mesh + bins + slabs + output; }
};

/// Estimates from the areas of the mesh and the grid, before anything is built.
/// @param samples  along a voxel's side of a fog volume; 0 or 1: no more than the voxel's centre
/// @param format  name of the output format; empty for none
/// @param limit   bytes; slabs are cut to fit it
MemoryEstimate estimate_memory(const MeshInput& input, const VoxelGrid& grid, Axis axis,
                               int samples, const VoxelizeCommand& command, std::string_view format,
                               int threads, std::uint64_t limit);

}  // namespace strata::apps
