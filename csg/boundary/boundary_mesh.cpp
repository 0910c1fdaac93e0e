#include "strata/csg/boundary/boundary_mesh.h"

#include <new>
#include <utility>

#include "core/share_of.h"
#include "csg/boundary/boundary_arrangement.h"
#include "csg/boundary/triangulate_boundary.h"
#include "strata/csg/boundary/face_parts.h"

namespace strata::csg {
namespace {

// Parts for the labels that occur, in the order of the solids and of the parts of their faces.
void name_parts(const Tree& tree, const FaceParts& faces, BoundaryParts parts,
                std::vector<std::uint32_t> labels, SolidMesh& mesh) {
  if (mesh.triangles.empty()) return;
  if (parts == BoundaryParts::kOne) {
    mesh.parts.resize(1);
    return;
  }
  const std::size_t solids = tree.solids().size();
  std::vector<std::uint32_t> part_of(solids + faces.parts.size(), 0);
  for (const std::uint32_t label : labels) part_of[label] = 1;
  for (std::size_t l = 0; l < part_of.size(); ++l) {
    if (part_of[l] == 0) continue;
    part_of[l] = static_cast<std::uint32_t>(mesh.parts.size());
    MeshPart part = l < solids ? MeshPart{tree.solids()[l].name, tree.solids()[l].colour}
                               : faces.parts[l - solids];
    if (parts != BoundaryParts::kSolids) part.name.clear();
    mesh.parts.push_back(std::move(part));
  }
  for (std::uint32_t& label : labels) label = part_of[label];
  mesh.part_of = std::move(labels);
}

}  // namespace

Result<BoundaryMesh> boundary_mesh(const Tree& tree, Tree::NodeId root,
                                   const BoundaryOptions& options, const Execution& execution) {
  return boundary_mesh(tree, root, options, FaceParts(), execution);
}

Result<BoundaryMesh> boundary_mesh(const Tree& tree, Tree::NodeId root,
                                   const BoundaryOptions& options, const FaceParts& faces,
                                   const Execution& execution) try {
  auto boundary =
      find_exact_boundary(tree, root, options, detail::share_of(execution, 0.0, 0.6), faces);
  if (!boundary) return tl::unexpected(boundary.error());
  auto triangulated =
      triangulate_boundary(boundary->faces, boundary->lattice, options.float_positions,
                           detail::share_of(execution, 0.6, 1.0));
  if (!triangulated) return tl::unexpected(triangulated.error());
  BoundaryMesh result;
  result.report = std::move(boundary->report);
  result.report.shells = triangulated->shells;
  result.report.repaired = triangulated->repaired;
  result.report.repair_rounds = triangulated->repair_rounds;
  result.report.vertices_split = triangulated->vertices_split;
  result.mesh.positions = std::move(triangulated->positions);
  result.mesh.triangles = std::move(triangulated->triangles);
  name_parts(tree, faces, options.parts, std::move(triangulated->labels), result.mesh);
  if (execution.progress) execution.progress(1.0);
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the boundary of the tree");
}

}  // namespace strata::csg
