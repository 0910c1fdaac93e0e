#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/mesh/solid_mesh.h"

namespace strata::csg {

/// What boundary_mesh() does with solids that are not closed.
enum class OpenSolids : std::uint8_t {
  kCap,   ///< each hole is closed by triangles from its edges to its middle
  kFail,  ///< kGeometry, naming the solid and its first open edge
};

/// Which faces a boundary mesh has.
enum class BoundaryFaceKind : std::uint8_t {
  kCanonical,  ///< as large as they can be: they depend on the set of points alone
  kInput,      ///< the pieces of the solids' own triangles
};

/// What the parts of a boundary mesh are.
enum class BoundaryParts : std::uint8_t {
  kOne,      ///< all in one part
  kColours,  ///< a part for each colour of the solids that faces come from
  kSolids,   ///< a part for each solid that faces come from
};

/// Settings of boundary_mesh() and exact_measures().
struct BoundaryOptions {
  int bits = 26;  ///< lattice steps along the longest side of the result's box: 2^bits; 10 to 28
  OpenSolids open = OpenSolids::kCap;                     ///< solids with holes
  BoundaryFaceKind faces = BoundaryFaceKind::kCanonical;  ///< how large they are
  BoundaryParts parts = BoundaryParts::kOne;              ///< of the mesh
  /// Positions will be written as float: they are rounded to float, and checked there.
  bool float_positions = false;
};

/// A hole of a solid that was closed.
struct BoundaryCap {
  std::uint32_t solid = 0;  ///< index in the tree
  std::uint64_t edges = 0;  ///< around the hole
  double length = 0;        ///< of them, world units
  double area = 0;          ///< of the cap, square world units
};

/// How a boundary was made.
struct BoundaryReport {
  double step = 0;              ///< of the lattice that all solids were snapped to, world units
  int coarsened = 0;            ///< bits that were given up because solids reach far out
  std::uint64_t solids = 0;     ///< below the root
  std::uint64_t triangles = 0;  ///< of those
  std::uint64_t pairs = 0;      ///< of triangles that may meet
  std::uint64_t points = 0;     ///< where triangles cut each other
  std::uint64_t pieces = 0;     ///< of triangles
  std::uint64_t cells = 0;      ///< of space, between the triangles
  std::uint64_t shells = 0;     ///< of the mesh
  std::uint64_t repaired = 0;   ///< places where rounding made faces meet
  int repair_rounds = 0;        ///< until no faces met any more
  std::uint64_t vertices_split = 0;  ///< where the result touches itself
  std::vector<BoundaryCap> caps;     ///< that closed holes of solids
};

/// A mesh and how it was made.
struct BoundaryMesh {
  SolidMesh mesh;         ///< closed, and checked
  BoundaryReport report;  ///< how it was made
};

/// The boundary of the result of `root`, exact on a lattice to which all solids are snapped once.
/// The mesh is closed, 2-manifold, and no two of its triangles meet but in edges and vertices of
/// both; all this is checked at the positions that are returned. Two trees that are the same set
/// on the same lattice give the same mesh, whatever the order of operands, triangles and threads.
///
/// Method: the sheets around each edge of the arrangement of all triangles are sorted by angle, as
/// crossings are sorted along a ray, and the tree is evaluated from cell to cell
/// (docs/decisions).
/// @param root  Tree::kNone gives no triangles
/// @return kUsage (options; a tree that check_tree() refuses), kGeometry (open solids with
/// OpenSolids::kFail; a result that stays unclean after all repairs), kLimit, kCancelled
Result<BoundaryMesh> boundary_mesh(const Tree& tree, Tree::NodeId root,
                                   const BoundaryOptions& options = {},
                                   const Execution& execution = {});

/// Exact sizes of a tree's result: those of its snapped solids, as the nearest doubles.
struct ExactMeasures {
  double volume = 0;  ///< cubic world units
  /// Bound for the change of the volume by snapping to the lattice: half a cell's diagonal times
  /// the area.
  double volume_snap_error = 0;
  double area = 0;        ///< square world units
  double area_error = 0;  ///< bound for its rounding
  glm::dvec3 centre{0};   ///< of mass, world space
  /// The tensor of inertia about the centre for the density 1, as xx, yy, zz, yz, zx, xy.
  std::array<double, 6> inertia{};
  glm::dvec3 low{0};      ///< lower corner of the box around the result, world space
  glm::dvec3 high{0};     ///< its upper corner
  bool empty = true;      ///< the result has no inside
  BoundaryReport report;  ///< how they were found
};

/// Measures without making a mesh. Errors as for boundary_mesh().
Result<ExactMeasures> exact_measures(const Tree& tree, Tree::NodeId root,
                                     const BoundaryOptions& options = {},
                                     const Execution& execution = {});

}  // namespace strata::csg
