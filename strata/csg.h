#pragma once

#include "strata/contour/contour.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/measure/measure.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/scene/scene.h"
#include "strata/csg/solid_lists.h"
#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/writers/write_solid.h"
#include "strata/raster/view.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/voxelize.h"

/// Everything for Boolean trees of solids. Build a tree from meshes with operators (csg::Tree) or
/// read it (csg::read_scene); then draw it (csg::picture), measure its volume and area
/// (csg::measure, csg::exact_measures), make a mesh of it (csg::boundary_mesh, write_solid) or
/// voxelize it (csg::voxelize). examples/csg_tree.cpp shows each.
namespace strata::csg {

/// The voxels of a tree's result, like strata::voxelize() of a mesh: a voxel is solid when its
/// centre is in the result. The options' `filter` is ignored.
/// @return also kUsage for a tree that check_tree() refuses
inline Result<VoxelIntervals> voxelize(const Tree& tree, const VoxelGrid& grid,
                                       VoxelizeOptions options = {},
                                       const Execution& execution = {},
                                       VoxelizeReport* report = nullptr) {
  if (auto checked = check_tree(tree, tree.root()); !checked) {
    return tl::unexpected(checked.error());
  }
  SolidLists lists(tree, tree.root());
  if (auto done = lists.fit(grid, nullptr, execution); !done) return tl::unexpected(done.error());
  options.filter = &lists.filter();
  return strata::voxelize(lists.soup(), grid, options, execution, report);
}

/// The surface of a tree's result, like strata::contour() of a mesh. The options' `filter` is
/// ignored. @return also kUsage for a tree that check_tree() refuses
inline Result<ContourMesh> contour(const Tree& tree, const VoxelGrid& grid,
                                   ContourOptions options = {}, const Execution& execution = {}) {
  if (auto checked = check_tree(tree, tree.root()); !checked) {
    return tl::unexpected(checked.error());
  }
  SolidLists lists(tree, tree.root());
  if (auto done = lists.fit(grid, nullptr, execution); !done) return tl::unexpected(done.error());
  options.filter = &lists.filter();
  return strata::contour(lists.soup(), grid, options, execution);
}

}  // namespace strata::csg
