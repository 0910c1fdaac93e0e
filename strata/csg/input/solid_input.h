#pragma once

#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/csg/input/mesh_input.h"
#include "strata/csg/solid_lists.h"
#include "strata/csg/tree.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// All inputs as one soup, for voxels and depth lists.
struct SolidInput {
  TriangleSoup soup;
  /// Of trees: what makes the lists of the result of the lists of the soup, all solids'. Where
  /// has_scene(), area and volume are not known, and the bounds may be larger than the result.
  std::shared_ptr<SolidLists> tree;
  std::shared_ptr<const Tree> scene;  ///< what `tree` was made of, without meshes
  std::vector<InputFacts> files;
  Bounds bounds;
  bool closed = true;                      ///< all of them
  InsideRule rule = InsideRule::kWinding;  ///< of the soup; solids of a tree have their own
  double area = 0.0, volume = 0.0, longest_edge = 0.0;
  double read_ms = 0.0, diagnose_ms = 0.0;

  /// Counts one more mesh in, all but its triangles.
  void add(InputFacts facts);
  /// The lists of a tree take the place of the soup.
  void set_tree(Tree tree);
  [[nodiscard]] bool has_scene() const;
  /// Cuts off what does not fit the lattice of a grid; rays through the grid see no difference.
  /// @return kGeometry, kCancelled
  Result<void> fit(const VoxelGrid& grid, const Execution& execution = {});
};

/// Reads the files and unites them: scenes, and meshes as load_mesh() does. Of several meshes of
/// which some take parity a tree is made. @return kInput, kUsage, kLimit, kCancelled
/// @param as_tree  meshes become the solids of a tree, each by itself
Result<SolidInput> load_solids(const SceneInput& input, bool as_tree = false,
                               const InputMessages& messages = {}, const Execution& execution = {});

}  // namespace strata::csg
