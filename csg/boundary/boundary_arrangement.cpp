#include "csg/boundary/boundary_arrangement.h"

#include <array>
#include <map>
#include <optional>

#include "core/share_of.h"
#include "csg/arrangement/find_faces.h"
#include "csg/boundary/open_edges.h"
#include "csg/lattice/live_zone.h"

namespace strata::csg {
namespace {

// The labels of all solids, then of all parts of their faces. Equal colours have equal labels where
// those are the parts.
std::vector<std::uint32_t> labels_of(const Tree& tree, BoundaryParts parts,
                                     const FaceParts& faces) {
  std::vector<std::uint32_t> labels;
  if (parts == BoundaryParts::kOne) return labels;
  using Key = std::array<float, 5>;
  std::map<Key, std::uint32_t> known;
  const auto add = [&](const std::optional<glm::vec4>& colour) {
    const auto label = static_cast<std::uint32_t>(labels.size());
    const glm::vec4 c = colour.value_or(glm::vec4(0.0f));
    const Key key{colour ? 1.0f : 0.0f, c.r, c.g, c.b, c.a};
    const bool joined = parts == BoundaryParts::kColours;
    labels.push_back(joined ? known.try_emplace(key, label).first->second : label);
  };
  for (const Solid& solid : tree.solids()) add(solid.colour);
  for (const MeshPart& part : faces.parts) add(part.colour);
  return labels;
}

// Labels the triangles where solids have several parts.
// @pre the triangles are those of the meshes, solid by solid
Result<void> label_triangles(const Tree& tree, const FaceParts& faces,
                             const std::vector<std::uint32_t>& labels, LatticeSolids& solids) {
  if (faces.of_triangles.empty() || labels.empty()) return {};
  if (faces.of_triangles.size() != tree.solids().size()) {
    return fail(ErrorCode::kUsage, "parts are given for {} solids, the tree has {}",
                faces.of_triangles.size(), tree.solids().size());
  }
  for (std::size_t s = 0; s < solids.solid_count(); ++s) {
    const std::vector<std::uint32_t>& parts = faces.of_triangles[s];
    const Solid& solid = tree.solids()[s];
    const std::size_t count = solids.first_triangle[s + 1] - solids.first_triangle[s];
    if (!parts.empty() && (!solid.mesh || parts.size() != solid.mesh->triangles.size())) {
      return fail(ErrorCode::kUsage, "{}: parts of {} triangles are given, the mesh has {}",
                  solid.name, parts.size(), solid.mesh ? solid.mesh->triangles.size() : 0);
    }
    for (std::size_t t = 0; t < count; ++t) {
      if (parts.size() != count) {  // of one part, or cut off where it is vast
        solids.labels.push_back(labels[s]);
      } else if (parts[t] < faces.parts.size()) {
        solids.labels.push_back(labels[tree.solids().size() + parts[t]]);
      } else {
        return fail(ErrorCode::kUsage, "{}: triangle {} has the part {}, there are {}", solid.name,
                    t, parts[t], faces.parts.size());
      }
    }
  }
  return {};
}

}  // namespace

Result<BoundaryFaces> arrange_solids(LatticeSolids solids, const Tree& tree, Tree::NodeId root,
                                     const std::vector<InsideRule>& rules,
                                     const BoundaryOptions& options, const Execution& execution,
                                     BoundaryReport& report, std::uint64_t most_rows,
                                     std::vector<std::uint32_t> labels) {
  const LiveZone zone = LiveZone::find(solids, tree, root, rules, most_rows, execution);
  auto welded = weld_solids(std::move(solids), execution);
  if (!welded) return tl::unexpected(welded.error());
  if (welded->triangles.empty()) return BoundaryFaces{};
  MeshEdges edges = find_mesh_edges(welded->triangles, welded->vertices.size());
  if (edges.equal_triangles) {
    merge_equal_triangles(*welded);
    if (welded->triangles.empty()) return BoundaryFaces{};
    edges = find_mesh_edges(welded->triangles, welded->vertices.size());
  }
  const auto report_done = [&](double done) {
    if (execution.progress) execution.progress(done);
  };
  auto pairs = find_candidate_pairs(*welded, edges, tree.solids().size(), zone,
                                    detail::share_of(execution, 0.1, 0.4));
  if (!pairs) return tl::unexpected(pairs.error());
  PointTable table(BoundaryPoints(std::move(welded->vertices), std::move(welded->triangles)));
  const BoundaryPoints& points = table.points();
  const ArrangementInput input{points.vertices(), points.triangles(), *welded, edges, zone};
  CutLines lines;
  if (auto met = meet_pairs(input, *pairs, table, lines, execution); !met) {
    return tl::unexpected(met.error());
  }
  report.pairs = pairs->size();
  *pairs = {};  // here and below: memory goes as soon as it can
  report_done(0.6);
  if (auto crossed = cross_lines(input, table, lines, execution); !crossed) {
    return tl::unexpected(crossed.error());
  }
  report_done(0.7);
  table.stop_finding();
  std::optional<SortedLines> sorted = sort_lines(input, points, lines);
  lines.line_points = {};
  const auto pieces = find_pieces(input, points, lines, *sorted, execution);
  if (!pieces) return tl::unexpected(pieces.error());
  sorted.reset();
  lines.cuts = {};
  report_done(0.85);
  const auto lists = find_radial_lists(input, lines, *pieces, execution);
  if (!lists) return tl::unexpected(lists.error());
  const FaceRules face_rules{options.faces == BoundaryFaceKind::kCanonical, std::move(labels)};
  const auto values = find_cell_values(input, points, lines, *pieces, *lists, compile(tree, root),
                                       rules, !face_rules.label_of_solid.empty(), execution);
  if (!values) return tl::unexpected(values.error());
  report_done(0.95);
  report.points = points.size() - points.vertices().size();
  report.pieces = pieces->triangle_of.size();
  report.cells = lists->cell_count;
  BoundaryFaces faces = find_faces(input, points, lines, *pieces, *lists, *values, face_rules);
  faces.points = table.take();
  return faces;
}

Result<ExactBoundary> find_exact_boundary(const Tree& tree, Tree::NodeId root,
                                          const BoundaryOptions& options,
                                          const Execution& execution, const FaceParts& faces) {
  if (options.bits < 10 || options.bits > 28) {
    return fail(ErrorCode::kUsage, "bits must be 10 to 28, got {}", options.bits);
  }
  if (auto checked = check_tree(tree, root); !checked) return tl::unexpected(checked.error());
  std::optional<Geometry> geometry(std::in_place, tree, execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  auto solids = snap_solids(tree, root, *geometry, options.bits, execution);
  if (!solids) return tl::unexpected(solids.error());
  ExactBoundary result;
  result.lattice = solids->lattice;
  BoundaryReport& report = result.report;
  report.step = solids->lattice.step;
  report.coarsened = solids->coarsened;
  for (std::size_t s = 0; s < solids->solid_count(); ++s) {
    report.solids += solids->first_triangle[s] < solids->first_triangle[s + 1];
  }
  report.triangles = solids->triangles.size();
  std::vector<std::uint32_t> labels = labels_of(tree, options.parts, faces);
  if (auto done = label_triangles(tree, faces, labels, *solids); !done) {
    return tl::unexpected(done.error());
  }
  if (auto closed = close_solids(*solids, options.open, tree, execution); closed) {
    report.caps = std::move(*closed);
  } else {
    return tl::unexpected(closed.error());
  }
  std::vector<InsideRule> rules;
  for (const Geometry::Part& part : geometry->parts()) rules.push_back(part.rule);
  geometry.reset();  // the solids are on the lattice
  const std::uint64_t rows = LiveZone::usual_rows(*solids);
  auto found = arrange_solids(std::move(*solids), tree, root, rules, options, execution, report,
                              rows, std::move(labels));
  if (!found) return tl::unexpected(found.error());
  result.faces = *std::move(found);
  return result;
}

}  // namespace strata::csg
