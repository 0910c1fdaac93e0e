#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

#include "strata/core/grid.h"
#include "strata/voxelize/grid_frame.h"

namespace strata {

/// What the voxels of an OpenVDB file hold: nothing, they are active (MaskGrid); true (BoolGrid);
/// numbers (FloatGrid) or colours (Vec3SGrid: light of red, green and blue), which are compressed
/// by zlib.
enum class VdbValues { kMask, kBool, kFloat, kColour };

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

}  // namespace strata
