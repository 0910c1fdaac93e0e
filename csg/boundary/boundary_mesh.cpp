#include "strata/csg/boundary/boundary_mesh.h"

#include <new>

#include "core/share_of.h"
#include "csg/boundary/boundary_arrangement.h"
#include "csg/boundary/triangulate_boundary.h"

namespace strata::csg {
namespace {

// Parts for the labels that occur, in the order of the solids.
void name_parts(const Tree& tree, BoundaryParts parts, std::vector<std::uint32_t> labels,
                SolidMesh& mesh) {
  if (mesh.triangles.empty()) return;
  if (parts == BoundaryParts::kOne) {
    mesh.parts.resize(1);
    return;
  }
  std::vector<std::uint32_t> part_of_solid(tree.solids().size(), 0);
  for (const std::uint32_t label : labels) part_of_solid[label] = 1;
  for (std::size_t s = 0; s < part_of_solid.size(); ++s) {
    if (part_of_solid[s] == 0) continue;
    part_of_solid[s] = static_cast<std::uint32_t>(mesh.parts.size());
    const Solid& solid = tree.solids()[s];
    const bool named = parts == BoundaryParts::kSolids;
    mesh.parts.push_back({named ? solid.name : std::string(), solid.colour});
  }
  for (std::uint32_t& label : labels) label = part_of_solid[label];
  mesh.part_of = std::move(labels);
}

}  // namespace

Result<BoundaryMesh> boundary_mesh(const Tree& tree, Tree::NodeId root,
                                   const BoundaryOptions& options, const Execution& execution) try {
  auto boundary = find_exact_boundary(tree, root, options, detail::share_of(execution, 0.0, 0.6));
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
  name_parts(tree, options.parts, std::move(triangulated->labels), result.mesh);
  if (execution.progress) execution.progress(1.0);
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the boundary of the tree");
}

}  // namespace strata::csg
