#pragma once

#include <cstdint>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/mesh/solid_mesh.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/voxelize.h"

namespace strata {

/// Settings of contour(). They mean what they mean in VoxelizeOptions.
struct ContourOptions {
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside
  /// What to do with a mesh that is not closed: OpenMode::kVote or OpenMode::kFail.
  OpenMode open = OpenMode::kVote;
  /// Whether the mesh is known to be closed. With a filter there is no check.
  Closedness closedness = Closedness::kCheck;
  /// Transforms the mesh's lists before they are contoured, e.g. for a Boolean tree. Borrowed. It
  /// has no labels: SolidLists::unlabelled_filter().
  const TileListFilter* filter = nullptr;
};

/// How a contour was made.
struct ContourReport {
  bool closed = true;           ///< the mesh was found or assumed to be closed
  std::uint64_t crossings = 0;  ///< edges between neighbouring voxel centres that the surface cuts
  std::uint64_t cells = 0;      ///< cubes between eight voxel centres that the surface passes
  std::uint64_t ambiguous_cells = 0;   ///< cells with several vertices or a face cut four times
  std::uint64_t fans = 0;              ///< cut edges with a vertex; the others have two triangles
  std::uint64_t merged_crossings = 0;  ///< cut edges whose triangles became part of larger ones
  std::uint64_t middle_vertices = 0;   ///< added on faces between cells
  std::uint64_t clamped_vertices = 0;  ///< whose best place lay outside their cell
  /// Edges that the surface cuts, but both ends lie on the same side of it: there walls or gaps
  /// thinner than a voxel vanish, or a round part only grazes the edge.
  std::uint64_t lost_crossings = 0;
  /// Cut edges for which the lists along x or y hold no crossing. Above 0 only where a solid of a
  /// tree is open; there the middle of the edge is taken.
  std::uint64_t guessed_crossings = 0;
};

/// A contour and how it was made.
struct ContourMesh {
  SolidMesh mesh;        ///< one part without a name
  ContourReport report;  ///< counts
};

/// The surface of a mesh's or a tree's solid by dual contouring of its depth lists along x, y and
/// z. A cube between eight voxel centres (a cell) that the surface passes gets a vertex where the
/// planes of the triangles meet that cut the cell's edges, so corners and creases stay sharp: where
/// three planes cut the edges of a cell and meet in it, the vertex is that corner of the solid.
/// Flat parts along an axis, such as the sides of prisms, become long triangles.
///
/// Promised for any input: the mesh is closed, each edge has two triangles, each vertex one fan of
/// triangles, no two triangles meet but in common vertices and edges, and voxelized on the same
/// grid it gives the voxels of voxelize(mesh, grid). All vertices are points of the grid's lattice,
/// 1/256 voxel apart. Same mesh for any number of threads. Parts of the solid outside the grid are
/// cut off. Walls thinner than a voxel may vanish, as for voxels. Memory and time grow with the
/// surface.
///
/// Called as voxelize():
///     auto made = contour(input.soup, *fit_grid(input.bounds, {.resolution = 256}),
///                         {.rule = input.rule,
///                          .closedness = input.closed || input.tree ? Closedness::kAssumeClosed
///                                                                   : Closedness::kAssumeOpen,
///                          .filter = input.tree ? &input.tree->unlabelled_filter() : nullptr});
///
/// After T. Ju, F. Losasso, S. Schaefer, J. Warren: Dual contouring of Hermite data, 2002; and
/// T. Ju, T. Udeshi: Intersection-free contouring on an octree grid, 2006.
/// @param execution  memory_limit counts what is held beyond the mesh, the result included
/// @return kUsage (grid; OpenMode::kSurface; a labelled filter, or one with kAssumeOpen), kGeometry
/// (coordinates too large; an open mesh with OpenMode::kFail), kLimit, kCancelled
Result<ContourMesh> contour(const TriangleSoup& mesh, const VoxelGrid& grid,
                            const ContourOptions& options = {}, const Execution& execution = {});

}  // namespace strata
