#pragma once

#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/solid_lists.h"
#include "strata/csg/tree.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// All inputs as one soup, for voxels and depth lists.
struct SolidInput {
  TriangleSoup soup;  ///< the triangles of all inputs
  /// For a tree: turns the lists of the soup, which holds all solids, into the lists of the result.
  /// For a scene or an expression, area and volume are not known, and the bounds may be larger than
  /// the result.
  std::shared_ptr<SolidLists> tree;
  std::shared_ptr<const Tree> scene;  ///< the tree that `tree` was made from, without meshes
  std::vector<InputFacts> files;      ///< the facts of each input, in the order given
  Bounds bounds;                      ///< of the inputs in the world
  bool turned = false;  ///< the soup and the tree are turned by SceneInput::space_from_world
  /// With SceneInput::attributes, where there is no tree: of the soup, all files as one.
  MeshAttributes attributes;
  bool closed = true;                      ///< all files are closed
  InsideRule rule = InsideRule::kWinding;  ///< of the soup; solids of a tree have their own
  double area = 0.0;                       ///< sum over the files, square world units
  double volume = 0.0;                     ///< sum over the files, cubic world units
  double longest_edge = 0.0;               ///< of all files, world units
  double unit_metres = 0.0;                ///< length of the world's unit; 0: unknown
  double read_ms = 0.0;                    ///< time that reading took
  double diagnose_ms = 0.0;                ///< time that inspection took

  /// Adds the facts of one more mesh, without its triangles.
  void add(InputFacts facts);
  /// Replaces the soup by a tree.
  void set_tree(Tree tree);
  /// Whether one of the files is a scene.
  [[nodiscard]] bool has_scene() const;
  /// Clamps parts that do not fit the lattice of a grid; rays through the grid see no difference.
  /// @return kGeometry, kCancelled
  Result<void> fit(const VoxelGrid& grid, const Execution& execution = {});
};

/// Reads the files, meshes as load_mesh() does, and unites them, or combines them by
/// input.expression. Several meshes become a tree if parity is the rule of one of them.
/// @return kInput, kUsage, kLimit, kCancelled; kGeometry if the result of a scene or expression is
/// empty
/// @param as_tree  each mesh becomes a solid of a tree; one of several parts as many as it has.
/// Names of parts that several files have are "FILE:PART"
Result<SolidInput> load_solids(const SceneInput& input, bool as_tree = false,
                               const InputMessages& messages = {}, const Execution& execution = {});

}  // namespace strata::csg
