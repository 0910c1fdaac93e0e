#pragma once

#include <cstdint>
#include <string_view>

#include "strata/core/grid.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// What a job is expected to hold at most, in bytes.
struct MemoryEstimate {
  std::uint64_t mesh = 0;    ///< triangles, positions, positions on the lattice
  std::uint64_t bins = 0;    ///< which triangles meet which tile
  std::uint64_t slabs = 0;   ///< intervals in flight, and tables of the threads
  std::uint64_t output = 0;  ///< what the format must hold until the end

  [[nodiscard]] std::uint64_t total() const { return mesh + bins + slabs + output; }
};

/// What decides the memory of voxels that are made and written.
struct MemoryFactors {
  const TriangleSoup* mesh = nullptr;  ///< of a tree all its solids; not null
  bool is_tree = false;
  double area = 0.0;             ///< of a mesh that is no tree, square world units
  bool votes = false;            ///< the mesh is open, and its voxels are voted on
  std::uint64_t open_edges = 0;  ///< of such a mesh: edges that are not balanced
  // The voxels.
  Axis axis = Axis::kZ;
  int samples = 0;  ///< along a voxel's side of a fog volume; 0 or 1: no more than its centre
  bool solid = true, surface = false;
  // The file.
  std::string_view format;  ///< name of the output format; empty: none
  bool ids = false, fog = false;
  // The machine.
  int threads = 1;
  std::uint64_t limit = 0;  ///< bytes, 0: none; slabs are cut to fit it
};

/// Estimates from the area of the mesh and the grid, before anything is built.
[[nodiscard]] MemoryEstimate estimate_memory(const VoxelGrid& grid, const MemoryFactors& factors);

}  // namespace strata
