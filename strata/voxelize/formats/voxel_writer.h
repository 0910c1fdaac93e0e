#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/output/voxel_output.h"

namespace strata {

/// One output format of `strata voxelize`.
struct VoxelFormat {
  std::string name;         ///< what --format takes, such as "vdb"
  std::string extension;    ///< with the dot; that of a folder format ends with a slash
  std::string description;  ///< one line for --list-formats
  std::string also = {};    ///< another extension of the format; empty: none
  /// Intervals along this axis are written as they come. Intervals along another axis are
  /// transposed first (voxelize/output/transposed.h).
  Axis axis = Axis::kZ;
  std::size_t colours = 0;  ///< most colours in a file, one per voxel; 0: none
  std::uint32_t ids = 0;    ///< the largest id that a voxel can have; 0: no ids
  bool named = false;       ///< holds the name of the grid
  bool shares = false;      ///< holds VoxelWriterOptions::fog
  bool rgba = false;        ///< holds VoxelWriterOptions::rgba
  bool distances = false;   ///< holds VoxelWriterOptions::band
  bool pictures = false;    ///< layers are pictures: VoxelWriterOptions::layers
  bool turned = false;      ///< holds GridFrame::direction
  bool levels = false;      ///< holds VoxelWriterOptions::levels
};

/// The formats this build can write.
[[nodiscard]] const std::vector<VoxelFormat>& voxel_formats();

/// Opens a writer for `path` ("-": standard output). The format is `format`, or if that is empty
/// the path's extension. @return kUsage: unknown format, unknown extension, a folder format on
/// standard output, a grid or values that the format cannot hold, values of two kinds;
/// kOutput: the file or folder cannot be made.
Result<std::unique_ptr<VoxelWriter>> open_voxel_writer(const std::string& path,
                                                       const std::string& format,
                                                       const VoxelGrid& grid,
                                                       const VoxelWriterOptions& options = {});

/// Writes a whole set, along any axis, as `strata voxelize -o path` would. @pre all rows of its
/// grid
/// @return as open_voxel_writer; kOutput, kLimit, kCancelled
Result<void> write_voxels(const VoxelIntervals& set, const std::string& path,
                          const VoxelWriterOptions& options = {}, const Execution& execution = {});

/// The format that open_voxel_writer would choose. @return kUsage as there
Result<VoxelFormat> voxel_format_for(const std::string& path, const std::string& format);

/// Checks that a format can store ids up to `largest`. @return kUsage naming those that can
Result<void> check_ids(const VoxelFormat& format, std::uint32_t largest);
/// Checks that a format holds what `options` say the values are. @return kUsage naming the formats
/// that do
Result<void> check_values(const VoxelFormat& format, const VoxelWriterOptions& options);

/// Checks that a format can hold a grid that is turned in the world. @return kUsage naming those
/// that can
Result<void> check_frame(const VoxelFormat& format, const GridFrame& frame);

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
  int rays = 0;          ///< as VoxelizeOptions::rays
  bool solid = true;     ///< as VoxelizeOptions::solid
  bool surface = false;  ///< as VoxelizeOptions::surface
  // The file.
  std::string_view format;  ///< name of the output format; empty: none
  bool ids = false;         ///< voxels have ids
  bool fog = false;         ///< a fog volume
  double band = 0.0;        ///< of distances, in voxels; 0: none
  bool everywhere = false;  ///< distances go beyond the band
  // The machine.
  int threads = 1;          ///< as Execution::thread_count()
  std::uint64_t limit = 0;  ///< bytes, 0: none; slabs are cut to fit it
};

/// Estimates from the area of the mesh and the grid, before anything is built.
[[nodiscard]] MemoryEstimate estimate_memory(const VoxelGrid& grid, const MemoryFactors& factors);

}  // namespace strata
