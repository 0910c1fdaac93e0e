#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <memory>
#include <string>
#include <vector>

#include "python/call.h"
#include "strata/core/grid.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/scene/scene.h"
#include "strata/picture/pixels.h"
#include "strata/raster/view.h"
#include "strata/voxelize/grid_frame.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/volume/voxel_volume.h"

// What Python's objects hold. None changes once it is made, so threads may share it.

namespace strata::python {

/// Sentences that become Python's warnings.
using Warnings = std::vector<std::string>;
/// Callbacks that collect them. Borrows `warnings`.
[[nodiscard]] csg::InputMessages collect(Warnings& warnings);

/// strata.Mesh.
struct MeshData {
  csg::SolidInput input;  ///< one mesh, no tree
};
using MeshPtr = std::shared_ptr<MeshData>;
/// A mesh of triangles that were made, not read.
[[nodiscard]] Result<MeshPtr> mesh_of(TriangleSoup soup, const std::string& name, InsideRule rule,
                                      bool keep_orientation, Warnings& warnings,
                                      const Execution& execution);

/// strata.csg.Solid.
struct SolidData {
  csg::Scene scene;
};
using SolidPtr = std::shared_ptr<SolidData>;

/// strata.Voxels.
struct VoxelsData {
  VoxelVolume volume;
  GridFrame frame;
  /// Labels are filled fractions: label / full. 0: they are not.
  std::uint32_t full = 0;
  bool rgba = false;  ///< labels are packed colours
  bool made = false;  ///< values were found here, not read from a file
  double band = 0.0;  ///< of distances, world units; 0: they go on beyond it
};
using VoxelsPtr = std::shared_ptr<VoxelsData>;

/// Adds the tiles of a slab to a set of the same grid and axis.
void add_slab(VoxelIntervals& set, const VoxelIntervals& slab);

/// A camera as Python gives it; what is not given is found from what is to be seen.
struct CameraChoice {
  std::optional<std::array<double, 3>> eye, target, rotation;
  std::optional<double> distance;
  double field_of_view = Camera{}.field_of_view;
  bool orthographic = false;

  /// Whether it says where it stands.
  [[nodiscard]] bool placed() const { return eye || distance; }
  /// The camera, before it is placed.
  [[nodiscard]] Camera camera() const;
};

/// A picture as an array of height x width x 4 bytes.
[[nodiscard]] py::array array_of_picture(Picture&& picture);
/// Checks the sides of a picture, and that it fits the memory.
[[nodiscard]] Result<glm::ivec2> size_of(std::int64_t width, std::int64_t height,
                                         const Execution& execution);

}  // namespace strata::python
