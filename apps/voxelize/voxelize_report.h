#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "apps/voxelize/file_size.h"
#include "strata/core/grid.h"
#include "strata/csg/input/solid_input.h"
#include "strata/voxelize/area/boundary_area.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/open/lost_walls.h"

namespace strata::apps {

/// What --colours made.
struct ColourReport {
  bool of_solids = false;           ///< of a tree; else those of a mesh
  std::optional<glm::u8vec4> fill;  ///< of what lies within the surface; none: there is no such
  std::vector<bool> found;          ///< by red + 2^8 green + 2^16 blue

  /// Of a slab whose labels are packed colours.
  void add(const VoxelIntervals& slab);
  /// How many colours there are; alpha does not count.
  [[nodiscard]] std::uint64_t count() const;
};

/// What is known of a part of the grid, so that others can be added to it.
struct PartNumbers {
  std::uint64_t input_hash = 0;            ///< of the triangles, and of the tree
  std::uint64_t faces[3] = {0, 0, 0};      ///< of BoundaryArea
  std::vector<BoundaryArea::Seam> seams;   ///< of BoundaryArea
  std::uint64_t filled_steps = 0;          ///< by --coverage
  std::optional<VoxelWriterOptions> file;  ///< what the voxels of the output are; no output
};

/// All that `strata voxelize` can tell of a run.
struct VoxelizeOutcome {
  csg::SolidInput input;
  VoxelGrid grid;
  GridFrame frame;  ///< of the grid, with --like
  Axis axis = Axis::kZ;
  MemoryEstimate estimate;
  std::uint64_t read_peak = 0;  ///< the largest memory until the estimate was made, bytes
  VoxelizeReport report;
  bool measured = false;  ///< the report's statistics are filled
  LostWalls lost_walls;
  std::optional<DistanceReport> distances;  ///< with --sdf
  bool exact_boundary = false;  ///< they are those to the boundary of a tree, not to all faces
  double area_estimate = 0.0;   ///< of the set's boundary, square world units
  std::optional<VoxelFormat> format;  ///< of the output; none without one
  std::optional<std::uint64_t> output_bytes;
  std::vector<std::string> output_files;  ///< where -o is cut into several; empty: it is not
  std::optional<FileSize> file_size;      ///< of a dry run
  std::vector<std::uint64_t> id_voxels;   ///< of solid n of the scene, with --ids
  std::optional<ColourReport> colours;    ///< with --colours
  double filled_volume = 0.0;             ///< by --coverage, cubic world units
  PartNumbers part;                       ///< with --shard
  double write_ms = 0.0;
};

/// The largest memory that is expected: of reading, which is known, or of the rest.
[[nodiscard]] std::uint64_t expected_memory(const VoxelizeOutcome& outcome);

/// For people: a line a topic.
[[nodiscard]] std::string voxelize_text(const VoxelizeCommand& command,
                                        const VoxelizeOutcome& outcome, const Session& session);

/// What was made, as one line: "knot.vdb: 490 x 512 x 227 voxels of 0.0128, 9 096 600 solid,
/// 1.6 MB, 0.12 s".
[[nodiscard]] std::string made_line(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                                    double seconds);

/// For programs, as docs/json.md says.
/// @param name  of the command
[[nodiscard]] std::string voxelize_json(const VoxelizeCommand& command,
                                        const VoxelizeOutcome& outcome, const Session& session,
                                        std::string_view name = "voxelize");

}  // namespace strata::apps
