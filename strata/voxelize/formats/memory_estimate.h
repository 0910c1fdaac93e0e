#pragma once

#include <cstdint>
#include <string_view>

#include "strata/core/grid.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// The largest memory that a job is expected to hold, in bytes.
struct MemoryEstimate {
  std::uint64_t mesh = 0;    ///< triangles, positions, positions on the lattice
  std::uint64_t bins = 0;    ///< lists of the triangles that meet each tile
  std::uint64_t slabs = 0;   ///< intervals in flight, and tables of the threads
  std::uint64_t output = 0;  ///< data that the format must hold until the end

  /// The sum.
  [[nodiscard]] std::uint64_t total() const { return mesh + bins + slabs + output; }
};

/// The facts on which the memory for making and writing voxels depends.
struct MemoryFactors {
  const TriangleSoup* mesh = nullptr;  ///< or all solids of a tree; not null
  bool is_tree = false;                ///< `mesh` holds the solids of a tree
  double area = 0.0;                   ///< of the mesh, square world units; unused for a tree
  bool votes = false;                  ///< the mesh is open, and OpenMode::kVote decides its voxels
  std::uint64_t open_edges = 0;        ///< with `votes`: edges that are not balanced
  // The voxels.
  Axis axis = Axis::kZ;  ///< of the intervals
  int samples = 0;       ///< of a fog volume, along a voxel's side; 0 or 1: the centre alone
  bool solid = true;     ///< as VoxelizeOptions::solid
  bool surface = false;  ///< as VoxelizeOptions::surface
  // The file.
  std::string_view format;  ///< name of the output format; empty: none
  bool ids = false;         ///< voxels have ids
  bool fog = false;         ///< a fog volume
  // The machine.
  int threads = 1;          ///< as Execution::thread_count()
  std::uint64_t limit = 0;  ///< bytes, 0: none; slabs are cut to fit it
};

/// Estimates from the area of the mesh and the grid, before anything is built.
[[nodiscard]] MemoryEstimate estimate_memory(const VoxelGrid& grid, const MemoryFactors& factors);

}  // namespace strata
