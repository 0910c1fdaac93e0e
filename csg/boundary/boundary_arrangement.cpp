#include "csg/boundary/boundary_arrangement.h"

#include <optional>

#include "core/share_of.h"
#include "csg/arrangement/find_faces.h"
#include "csg/boundary/open_edges.h"
#include "csg/lattice/live_zone.h"

namespace strata::csg {
namespace {

// The label of each solid, so that equal colours have equal labels.
std::vector<std::uint32_t> labels_of(const Tree& tree, BoundaryParts parts) {
  std::vector<std::uint32_t> labels;
  if (parts == BoundaryParts::kOne) return labels;
  for (std::uint32_t s = 0; s < tree.solids().size(); ++s) {
    labels.push_back(s);
    for (std::uint32_t earlier = 0; parts == BoundaryParts::kColours && earlier < s; ++earlier) {
      if (tree.solids()[earlier].colour != tree.solids()[s].colour) continue;
      labels[s] = earlier;
      break;
    }
  }
  return labels;
}

}  // namespace

Result<BoundaryFaces> arrange_solids(LatticeSolids solids, const Tree& tree, Tree::NodeId root,
                                     const std::vector<InsideRule>& rules,
                                     const BoundaryOptions& options, const Execution& execution,
                                     BoundaryReport& report, std::uint64_t most_rows) {
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
  const FaceRules face_rules{options.faces == BoundaryFaceKind::kCanonical,
                             labels_of(tree, options.parts)};
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
                                          const Execution& execution) {
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
  if (auto closed = close_solids(*solids, options.open, tree, execution); closed) {
    report.caps = std::move(*closed);
  } else {
    return tl::unexpected(closed.error());
  }
  std::vector<InsideRule> rules;
  for (const Geometry::Part& part : geometry->parts()) rules.push_back(part.rule);
  geometry.reset();  // the solids are on the lattice
  const std::uint64_t rows = LiveZone::usual_rows(*solids);
  auto faces =
      arrange_solids(std::move(*solids), tree, root, rules, options, execution, report, rows);
  if (!faces) return tl::unexpected(faces.error());
  result.faces = std::move(*faces);
  return result;
}

}  // namespace strata::csg
