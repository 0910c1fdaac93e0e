#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

#include "strata/core/grid.h"
#include "strata/voxelize/grid_frame.h"
#include "voxelize/output/block_output.h"

namespace strata {

/// What the voxels of an OpenVDB file hold: nothing, they are active (MaskGrid); true (BoolGrid);
/// numbers (FloatGrid) or colours (Vec3SGrid: light of red, green and blue), which are compressed
/// by zlib.
enum class VdbValues { kMask, kBool, kFloat, kColour };

/// Sides of the nodes of a tree: of a lower node in leaves, which are 8 voxels a side, of an upper
/// node in lower nodes, and of both in voxels. (Internal to voxelize/.)
inline constexpr int kLowerLeaves = 16, kUpperLowers = 32;
inline constexpr int kLowerVoxels = 8 * kLowerLeaves, kUpperVoxels = kLowerVoxels * kUpperLowers;

/// What stands in an OpenVDB file before the tree (internal to voxelize/).
struct VdbHeader {
  std::string name;
  VoxelGrid grid;
  GridFrame frame;
  VdbValues values = VdbValues::kBool;
  bool fog = false;               ///< the class of the grid is fog volume
  bool level_set = false;         ///< it is level set; the numbers are not compressed
  std::uint64_t voxels = 0;       ///< active ones
  glm::ivec3 lower{0}, upper{0};  ///< bounds of the active voxels, inclusive, if there are any
  std::uint64_t hash = 0;         ///< of the content; becomes the file's UUID
  std::uint64_t topology_bytes = 0, buffers_bytes = 0;  ///< sizes of the two parts of the tree
};

/// The bytes of the header, the metadata and the transform, which take index coordinates (voxel
/// centres) to world space; the topology follows at once.
[[nodiscard]] std::string vdb_header_bytes(const VdbHeader& header);

/// Writes and commits a file: the header, `root`, which begins the topology, and the blocks of the
/// rest of the tree.
/// @param path  is only named in messages
/// @return as BlockOutput; kInternal if the tree has not the bytes that the header announces
Result<void> write_vdb_file(const std::string& path, const VdbHeader& header,
                            const std::string& root, std::size_t blocks,
                            const BlockOutput::MakeBlock& make, BlockOutput& output,
                            const Execution& execution);

}  // namespace strata
