#pragma once

#include <cstdint>
#include <functional>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/scalar_field.h"
#include "strata/voxelize/voxelize.h"

namespace strata {

/// Settings of signed_distance().
struct DistanceOptions {
  /// Half the width of the band around the surface, in voxels along their longest side; 0.5 to
  /// kMaxDistanceBand. Distances beyond it are +-band.
  double band = 3.0;
  /// All voxels have their distance, and the band only decides how they are found. Time and memory
  /// grow with the grid, then.
  bool everywhere = false;
  /// What is inside, as voxelize() finds it; `axis`, `samples` and `surface` are ignored. With an
  /// open mesh and OpenMode::kSurface nothing is inside.
  VoxelizeOptions solid{};
  /// The faces that distances are measured to, such as the boundary of a Boolean tree. Null: those
  /// of the mesh. Borrowed.
  const TriangleSoup* surface = nullptr;
  /// Also gets the voxels inside, slab by slab along x, before their distances are found.
  SlabSink inside{};
};

/// The widest band.
inline constexpr double kMaxDistanceBand = 1024.0;

/// What was found.
struct DistanceReport {
  VoxelizeReport solid;             ///< of all voxels inside; solid_voxels is always counted
  double band = 0.0;                ///< world units; 0: no voxel is beyond it
  std::uint64_t band_voxels = 0;    ///< voxels with |distance| < band
  std::uint64_t inside_voxels = 0;  ///< those of them that are inside
  float least = 0.0f;               ///< the least distance in the band, or 0
  float greatest = 0.0f;            ///< the greatest distance in the band, or 0
};

/// Half the width of the band in world units: `band` voxels along their longest side.
[[nodiscard]] double band_in_world(const VoxelGrid& grid, double band);

/// Receives the distances of layers z_begin, z_begin + 1, ... of all x and y, in increasing z: a
/// field with dims (dims.x, dims.y, layers). z_begin is a multiple of 64.
using DistanceSink = std::function<Result<void>(const ScalarField& layers, int z_begin)>;

/// Signed Euclidean distances, in world units, from voxel centres to the surface of `mesh`, whose
/// vertices are rounded to 1/256 voxel first: the surface that voxelize() sees. Rounding of float
/// aside, they are exact. Voxels need not be cubes.
///
/// The sign comes from voxelize(): negative in exactly those voxels that are solid there, whatever
/// the mesh overlaps, encloses or leaves open. A solid voxel whose centre lies on the surface has
/// the least normal float below 0. All faces count, those inside the solid too: give `surface`
/// where they must not. Triangles beyond the grid count. A mesh may be open: where caps close it,
/// the sign changes without the distance being small.
///
/// Time and memory grow with the surface and the band's width; layers are held 64 at a time.
/// @return kUsage (band), kGeometry (no triangles, with `everywhere`), else as voxelize_slabs(), or
/// the sink's error
Result<DistanceReport> signed_distance_slabs(const TriangleSoup& mesh, const VoxelGrid& grid,
                                             const DistanceOptions& options,
                                             const Execution& execution, const DistanceSink& sink);

/// The same in one piece: a field of the whole grid.
Result<ScalarField> signed_distance(const TriangleSoup& mesh, const VoxelGrid& grid,
                                    const DistanceOptions& options = {},
                                    const Execution& execution = {},
                                    DistanceReport* report = nullptr);

}  // namespace strata
