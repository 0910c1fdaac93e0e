#pragma once

/// From a mesh file to voxels:
///
///   auto file = strata::read_mesh("part.stl");  // or any TriangleSoup
///   auto grid = strata::fit_grid(strata::bounds(file->soup), {.resolution = 256});
///   auto set = strata::voxelize(file->soup, *grid);  // VoxelIntervals
///   auto done = strata::write_voxels(*set, "part.vdb");  // .npy, .vti, ...
///
/// Each returns a Result; an error is one sentence. A voxel is solid when its centre is inside the
/// mesh, whose vertices are rounded to 1/256 voxel; all else is exact. voxelize() checks whether
/// the mesh is closed: see VoxelizeOptions::open. Sets are runs of voxels along an axis: their
/// memory grows with the surface. VoxelIntervals::contains(), for_each_run() and to_dense() read a
/// set; read_voxels() reads one from a file; voxelize_slabs() and open_voxel_writer() never hold a
/// whole set. signed_distance() gives distances to the surface.
/// strata/voxelize/formats/openvdb_bridge.h passes a set to OpenVDB. contour() makes a closed mesh
/// whose voxels are the same.

#include "strata/contour/contour.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/area/boundary_area.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "strata/voxelize/voxelize.h"
