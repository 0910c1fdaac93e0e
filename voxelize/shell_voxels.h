#pragma once

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"

namespace strata {

/// The voxels that a surface fills, in rows [v_begin, v_end) of the grid, as intervals along
/// `axis`.
///
/// All tests are exact, in integers, on the snapped vertices. Voxel (i, j, k) is the closed box
/// [256 i, 256 (i + 1)] x ... of lattice points, its centre the lattice point 256 i + 128, ...; a
/// triangle is the closed convex hull of its three vertices, so zero-area triangles (segments,
/// points) count as well. Every set is the union over the triangles of the voxels with:
///
/// - kConservative: box and triangle have a point in common. A triangle that only touches a face,
///   an edge or a corner of a box fills it: a plate on a voxel boundary fills both sides. Nothing
///   of the surface within the grid lies outside the set, however thin the part.
/// - k26: the triangle meets one of the 13 line segments through the voxel's centre that end at the
///   centres of its faces, at the middles of its edges and at its corners. For a plane this is
///   Huang et al.'s 26-separating test; at borders of triangles it is the exact and thinner one.
/// - k6: the triangle meets one of the 3 line segments between the centres of opposite faces.
///
/// Guarantee of the thin sets: a step between two centres that are 26-neighbours (6-neighbours)
/// runs along half a segment of the one voxel and half a segment of the other. A step that meets
/// the surface therefore has an end in the set. So for a closed mesh, two voxels outside the set
/// have the same winding number if a path of 26-neighbours (6-neighbours) outside the set connects
/// them. The mesh needs no connectivity, and holes smaller than the spacing of the segments stay
/// sealed. k6 is always a subset of k26, and k26 of kConservative; where the surface meets a shared
/// end of two segments, both voxels are filled. (Laine 2013's segments, closed on both ends.)
///
/// Work is proportional to the runs of voxels stored (the thin sets: to the voxels of the
/// conservative one). The result does not depend on the axis, the threads or the order of the
/// triangles.
///
/// @pre grid.dims in [1, kMaxGridSide], v_begin is a multiple of VoxelIntervals::kTileSide,
///   0 <= v_begin < v_end <= rows of the grid; indices of mesh.triangles are in range
/// @return kLimit when bins, result and scratch outgrow execution.memory_limit, kCancelled
Result<VoxelIntervals> voxelize_shell(const LatticeMesh& mesh, const VoxelGrid& grid,
                                      SurfaceKind kind, Axis axis, int v_begin, int v_end,
                                      const Execution& execution = {});

/// The voxels of `a` or of `b`. O(intervals).
/// @return kUsage when the two differ in grid, axis or rows, kLimit when memory runs out,
/// kCancelled
Result<VoxelIntervals> union_intervals(const VoxelIntervals& a, const VoxelIntervals& b,
                                       const Execution& execution = {});

}  // namespace strata
