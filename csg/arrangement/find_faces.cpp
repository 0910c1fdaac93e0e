#include "csg/arrangement/find_faces.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <unordered_map>

#include "csg/arrangement/face_edges.h"
#include "exact/determinants.h"
#include "mesh/disjoint_sets.h"

namespace strata::csg {
namespace {

using exact::Normal;

bool parallel(const Normal& m, const Normal& n) { return exact::cross(m, n) == exact::Cross{}; }

class FaceFinder {
 public:
  FaceFinder(const ArrangementInput& input, const Pieces& pieces, const RadialLists& lists,
             const CellValues& values, const FaceRules& rules)
      : input_(input),
        pieces_(pieces),
        lists_(lists),
        values_(values),
        rules_(rules),
        planes_(input.triangles.size()),
        dropped_(pieces.triangle_of.size(), false),
        flat_(input.triangles.size(), false) {}

  void run(const CutLines& lines, FaceEdges& out);

 private:
  bool inside(std::uint32_t patch, bool back) const {
    return values_.inside[lists_.cell_of[2 * patch + (back ? 1 : 0)]];
  }
  bool kept(std::uint32_t piece) const {
    if (pieces_.is_dead(piece)) return false;
    const std::uint32_t patch = lists_.patch_of[piece];
    return inside(patch, false) != inside(patch, true) && !dropped_[piece];
  }
  std::uint32_t label(std::uint32_t piece) const {
    if (rules_.label_of_solid.empty()) return 0;
    const std::uint32_t solid = values_.solid_of_patch[lists_.patch_of[piece]];
    if (input_.solids.labels.empty()) return rules_.label_of_solid[solid];
    if (const auto own = input_.solids.label(pieces_.triangle_of[piece], solid)) return *own;
    const auto found = label_below_.find(piece);
    return found != label_below_.end() ? found->second : rules_.label_of_solid[solid];
  }
  bool melts_by_label(std::uint32_t s, std::uint32_t t) const {
    return rules_.melt && (input_.solids.labels.empty() || label(s) == label(t));
  }
  void find_label_below(const RadialLists::Group& group, std::uint32_t piece);
  Normal normal(std::uint32_t piece) const {
    return input_.plane_of(pieces_.triangle_of[piece]).normal;
  }
  void drop_repeated();
  void add_unlisted(FaceEdges& out);
  void add_triangle(FaceEdges& out, std::uint32_t t);
  bool melts(std::uint32_t piece, std::uint32_t other) const;
  void add_simple(FaceEdges& out, const AtomicEdge& edge);
  void add_radial(FaceEdges& out, const AtomicEdge& edge, const RadialLists::Edge& radial);
  void join_plane(FaceEdges& out, std::uint32_t piece, std::uint32_t other, std::uint32_t a,
                  std::uint32_t b);
  void add(FaceEdges& out, std::uint32_t piece, std::uint32_t from, std::uint32_t to,
           std::uint32_t wedge, std::uint32_t line) const;
  const RadialLists::Sheet& shown(const RadialLists::Group& group) const;

  const ArrangementInput& input_;
  const Pieces& pieces_;
  const RadialLists& lists_;
  const CellValues& values_;
  const FaceRules& rules_;
  detail::DisjointSets planes_;  // triangles with faces in one plane
  std::vector<bool> dropped_;    // pieces that lie where another piece is shown
  std::vector<bool> flat_;       // triangles that are no face by themselves
  // Of pieces whose triangle is not of the solid that bounds the result: the label of the triangle
  // of that solid in the same place.
  std::unordered_map<std::uint32_t, std::uint32_t> label_below_;
};

// Where pieces of several triangles lie in one place, that of the least triangle is shown: the same
// triangle for all chains around the place.
const RadialLists::Sheet& FaceFinder::shown(const RadialLists::Group& group) const {
  const auto sheets = lists_.sheets_of(group);
  return *std::ranges::min_element(sheets, {}, [&](const RadialLists::Sheet& sheet) {
    return pieces_.triangle_of[sheet.piece];
  });
}

void FaceFinder::drop_repeated() {
  for (const RadialLists::Group& group : lists_.groups) {
    if (group.sheet_count == 1) continue;
    const std::uint32_t piece = shown(group).piece;
    for (const RadialLists::Sheet& sheet : lists_.sheets_of(group)) {
      planes_.join(pieces_.triangle_of[sheet.piece], pieces_.triangle_of[piece]);
      if (sheet.piece != piece) dropped_[sheet.piece] = true;
    }
    if (!input_.solids.labels.empty()) find_label_below(group, piece);
  }
}

void FaceFinder::find_label_below(const RadialLists::Group& group, std::uint32_t piece) {
  const std::uint32_t solid = values_.solid_of_patch[lists_.patch_of[piece]];
  std::optional<std::uint32_t> least;
  for (const RadialLists::Sheet& sheet : lists_.sheets_of(group)) {
    const auto found = input_.solids.label(pieces_.triangle_of[sheet.piece], solid);
    if (found && (!least || *found < *least)) least = found;
  }
  if (least) label_below_[piece] = *least;
}

// An edge of a kept piece; from and to have the piece on the left as seen from its front.
void FaceFinder::add(FaceEdges& out, std::uint32_t piece, std::uint32_t from, std::uint32_t to,
                     std::uint32_t wedge, std::uint32_t line) const {
  const bool turned = inside(lists_.patch_of[piece], false);
  if (turned) std::swap(from, to);
  out.edges.push_back({pieces_.triangle_of[piece], turned, label(piece), from, to, wedge, line});
}

bool FaceFinder::melts(std::uint32_t piece, std::uint32_t other) const {
  const std::uint32_t s = pieces_.triangle_of[piece], t = pieces_.triangle_of[other];
  if (label(piece) != label(other)) return false;  // part of a triangle may lie on another solid
  return s == t || (rules_.melt && parallel(normal(piece), normal(other)));
}

void FaceFinder::join_plane(FaceEdges& out, std::uint32_t piece, std::uint32_t other,
                            std::uint32_t a, std::uint32_t b) {
  const std::uint32_t s = pieces_.triangle_of[piece];
  planes_.join(s, pieces_.triangle_of[other]);
  out.inner_points.push_back({s, a});
  out.inner_points.push_back({s, b});
}

// Mesh edges that have two triangles of the same solids and nothing else.
void FaceFinder::add_unlisted(FaceEdges& out) {
  for (std::uint32_t edge = 0; edge < input_.edges.size(); ++edge) {
    const auto uses = input_.edges.uses_of(edge);
    if (pieces_.edge_listed[edge]) {
      for (const std::uint32_t use : uses) flat_[use / 3] = true;
      continue;
    }
    const std::uint32_t s = uses[0] / 3, t = uses[1] / 3;
    if (!rules_.melt || !kept(s)) continue;
    const auto& vertices = input_.vertices;
    if (exact::height(input_.plane_of(s), vertices[input_.corner(uses[1], 2)]) != 0) continue;
    if (!melts_by_label(s, t)) continue;
    flat_[s] = flat_[t] = true;
    join_plane(out, s, t, input_.edge_from(edge), input_.edge_to(edge));
  }
  for (std::uint32_t t = 0; t < input_.triangles.size(); ++t) add_triangle(out, t);
}

void FaceFinder::add_triangle(FaceEdges& out, std::uint32_t t) {
  const glm::uvec3& c = input_.triangles[t];
  if (!flat_[t]) {
    if (!kept(t)) return;
    const bool turned = inside(lists_.patch_of[t], false);
    out.wholes.push_back({turned ? glm::uvec3(c.x, c.z, c.y) : c, label(t)});
    return;
  }
  for (std::uint32_t side = 0; side < 3; ++side) {
    const std::uint32_t edge = input_.edges.edge_of[3 * t + side];
    if (pieces_.edge_listed[edge]) continue;
    const auto uses = input_.edges.uses_of(edge);
    const std::uint32_t other = uses[0] / 3 == t ? uses[1] : uses[0];
    // The piece of t at this side is that of its patch: nothing cuts the edge.
    if (!kept(t)) continue;
    const exact::LatticePoint& far = input_.vertices[input_.corner(other, 2)];
    if (!melts_by_label(t, other / 3) || exact::height(input_.plane_of(t), far) != 0) {
      add(out, t, input_.corner(3 * t + side, 0), input_.corner(3 * t + side, 1), 0, edge);
    }
  }
}

// Two pieces of one patch.
void FaceFinder::add_simple(FaceEdges& out, const AtomicEdge& edge) {
  std::uint32_t left = EdgeUse::kNoPiece, right = EdgeUse::kNoPiece, line = 0;
  for (std::uint32_t u = edge.first_use; u < edge.first_use + edge.use_count; ++u) {
    const EdgeUse& use = pieces_.uses[u];
    line = use.line;
    if (use.left != EdgeUse::kNoPiece) left = use.left;
    if (use.right != EdgeUse::kNoPiece) right = use.right;
  }
  if (!kept(left)) return;
  if (melts(left, right)) return join_plane(out, left, right, edge.a, edge.b);
  add(out, left, edge.a, edge.b, 0, line);
  add(out, right, edge.b, edge.a, 0, line);
}

void FaceFinder::add_radial(FaceEdges& out, const AtomicEdge& edge,
                            const RadialLists::Edge& radial) {
  const auto groups = std::span(lists_.groups).subspan(radial.first_group, radial.group_count);
  std::vector<const RadialLists::Group*> changes;
  for (const RadialLists::Group& group : groups) {
    if (values_.inside[lists_.cell_before(group)] != values_.inside[lists_.cell_behind(group)]) {
      changes.push_back(&group);
    }
  }
  if (changes.empty()) return;
  const std::uint32_t line = pieces_.uses[edge.first_use].line;
  if (changes.size() == 2) {
    const auto &x = shown(*changes[0]), &y = shown(*changes[1]);
    if (melts(x.piece, y.piece)) return join_plane(out, x.piece, y.piece, edge.a, edge.b);
  }
  // Each inside begins at one change and ends at the next.
  const bool first_begins = values_.inside[lists_.cell_behind(*changes[0])];
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const RadialLists::Sheet& sheet = shown(*changes[i]);
    std::size_t wedge = 0;
    if (changes.size() > 2) {
      wedge = first_begins ? i / 2 + 1 : (i + 1) / 2 % (changes.size() / 2) + 1;
    }
    const auto number = static_cast<std::uint32_t>(wedge);
    add(out, sheet.piece, sheet.left ? edge.a : edge.b, sheet.left ? edge.b : edge.a, number, line);
  }
}

void FaceFinder::run(const CutLines& lines, FaceEdges& out) {
  for (const CutLines::Contact& contact : lines.contacts) flat_[contact.triangle] = true;
  drop_repeated();
  add_unlisted(out);
  auto radial = lists_.edges.begin();
  for (std::uint32_t e = 0; e < pieces_.edges.size(); ++e) {
    if (radial != lists_.edges.end() && radial->atomic_edge == e) {
      add_radial(out, pieces_.edges[e], *radial++);
    } else {
      add_simple(out, pieces_.edges[e]);
    }
  }
  out.plane_of.resize(input_.triangles.size());
  for (std::uint32_t t = 0; t < out.plane_of.size(); ++t) out.plane_of[t] = planes_.find(t);
}

}  // namespace

BoundaryFaces find_faces(const ArrangementInput& input, const BoundaryPoints& points,
                         const CutLines& lines, const Pieces& pieces, const RadialLists& lists,
                         const CellValues& values, const FaceRules& rules) {
  FaceEdges edges;
  FaceFinder(input, pieces, lists, values, rules).run(lines, edges);
  for (const CutLines::Contact& contact : lines.contacts) {
    edges.inner_points.push_back({contact.triangle, contact.point});
  }
  return join_face_edges(input, points, lines, std::move(edges));
}

}  // namespace strata::csg
