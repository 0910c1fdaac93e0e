#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec4.hpp>
#include <memory>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/colours/surface_colours.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/packed_colour.h"

namespace strata {

/// A colour of a solid, from 0 to 1, as bytes. Alpha is at least 1: a solid is there even where it
/// is transparent.
[[nodiscard]] glm::u8vec4 solid_colour_bytes(const glm::vec4& colour);

/// A slab with label(n) in place of each label n, which is 1 where the slab has none. Runs that
/// then touch and are alike become one. Several threads call `label` at once.
[[nodiscard]] VoxelIntervals relabelled(const VoxelIntervals& slab,
                                        const std::function<std::uint32_t(std::uint32_t)>& label,
                                        const Execution& execution = {});

/// Settings of VoxelColouring.
struct VoxelColourOptions {
  /// The voxels are a solid: those farther than one voxel from the surface have the colour
  /// `inside`. False: the voxels of a surface, all of which have its colours; those whose colour is
  /// fully transparent are left out.
  bool solid = false;
  glm::u8vec4 inside{128, 128, 128, 255};  ///< sRGB; alpha not 0
};

/// Gives voxels the colour of the surface point that is nearest to their centre, in units of voxels
/// along each axis. The surface is the snapped mesh. Of triangles that are equally near, the one
/// with the lowest number counts. A voxel of a solid has a colour of the surface if that point is
/// no farther than one voxel: so have all that the surface touches and all that can be seen from
/// outside.
///
/// Distances are compared as multiples of 2^-31 square voxels.
class VoxelColouring {
 public:
  /// Snaps the mesh. Keeps references to `mesh` and `colours`, whose triangles have the same
  /// numbers. @return as snap_to_lattice()
  static Result<VoxelColouring> create(const TriangleSoup& mesh, const VoxelGrid& grid,
                                       const SurfaceColours& colours,
                                       const VoxelColourOptions& options = {},
                                       const Execution& execution = {});
  VoxelColouring(VoxelColouring&&) noexcept;
  VoxelColouring& operator=(VoxelColouring&&) noexcept;
  ~VoxelColouring();

  /// The voxels of a slab with their colours as labels: packed_colour(). Labels of the slab do not
  /// count. Memory grows with the voxels that have a colour of the surface. @pre slab.grid() is the
  /// grid above @return kLimit, kCancelled
  Result<VoxelIntervals> colour(const VoxelIntervals& slab, const Execution& execution = {});

 private:
  struct Impl;
  explicit VoxelColouring(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata
