#include "csg/arrangement/cell_values.h"

#include <algorithm>

#include "core/buckets.h"
#include "csg/arrangement/winding_rays.h"
#include "exact/directions.h"

namespace strata::csg {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// Tells the windings of two cells apart. Of a solid with the parity rule only odd and even count.
class Fingerprint {
 public:
  void change(InsideRule rule, std::uint32_t solid, std::int32_t count) {
    std::uint64_t h = (solid + 1) * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 27) * 0x94d049bb133111ebu;
    if (rule != InsideRule::kParity) {
      sum_ += (h ^ h >> 31) * static_cast<std::uint64_t>(std::int64_t{count});
    } else if (count % 2 != 0) {
      parities_ ^= h ^ h >> 31;
    }
  }
  friend bool operator==(const Fingerprint&, const Fingerprint&) = default;

 private:
  std::uint64_t sum_ = 0, parities_ = 0;
};

// The windings of solids and what the tree makes of them.
class State {
 public:
  State(const Program& program, const std::vector<InsideRule>& rules)
      : program_(program), rules_(rules), windings_(rules.size(), 0) {}

  void add(std::span<const SolidCount> changes, int sign) {
    flipped_.clear();
    for (const auto& [solid, count] : changes) {
      const bool before = is_inside(rules_[solid], windings_[solid]);
      windings_[solid] += sign * count;
      fingerprint_.change(rules_[solid], solid, sign * count);
      if (is_inside(rules_[solid], windings_[solid]) != before) flipped_.push_back(solid);
    }
    if (flipped_.size() == 1) {
      program_.toggle(flipped_.front());
    } else if (!flipped_.empty()) {
      program_.toggle_all(flipped_);
    }
  }
  bool value() const { return program_.value(); }
  const Fingerprint& fingerprint() const { return fingerprint_; }
  /// Of the solids that the last change went into or out of, the first that the tree's value is
  /// due to.
  std::uint32_t decider() {
    for (const std::uint32_t solid : flipped_) {
      if (flipped_.size() == 1 || program_.decides(solid)) return solid;
    }
    return flipped_.empty() ? kNone : flipped_.front();
  }

 private:
  ProgramState program_;
  const std::vector<InsideRule>& rules_;
  std::vector<std::int32_t> windings_;
  Fingerprint fingerprint_;
  std::vector<std::uint32_t> flipped_;
};

class Walk {
 public:
  Walk(const ArrangementInput& input, const BoundaryPoints& points, const CutLines& lines_of_cuts,
       const Pieces& pieces, const RadialLists& lists, const Program& program,
       const std::vector<InsideRule>& rules, bool labels)
      : labels_(labels),
        input_(input),
        points_(points),
        lines_of_cuts_(lines_of_cuts),
        pieces_(pieces),
        lists_(lists),
        rules_(rules),
        state_(program, rules) {
    result_.inside.assign(lists.cell_count, false);
    result_.solid_of_patch.assign(lists.patch_count, kNone);
    fingerprints_.resize(lists.cell_count);
    seen_.assign(lists.cell_count, false);
  }

  Result<CellValues> run(const Execution& execution);

 private:
  // Sides of a patch: the cells in front of it and behind it.
  std::uint32_t cell(std::uint32_t patch, bool back) const {
    return lists_.cell_of[2 * patch + (back ? 1 : 0)];
  }
  void find_groups();
  void find_neighbours();
  void find_seeds();
  Nearby place_at(std::uint32_t triangle) const;
  Nearby place_at(const AtomicEdge& edge, const EdgeUse& use, bool left) const;
  void changes_of(std::uint32_t patch);
  void changes_of(const RadialLists::Group& group);
  void walk_from(std::uint32_t cell);
  void enter(std::uint32_t cell);
  bool wants_label(std::uint32_t patch) const {
    return labels_ && result_.solid_of_patch[patch] == kNone;
  }
  // The tree's value has just changed by changes_, times `sign`, in going through a patch. The
  // solid is looked for on the inside, wherever the walk comes from.
  void label(std::uint32_t patch, int sign) {
    if (!wants_label(patch)) return;
    const bool left = !state_.value();
    if (left) state_.add(changes_, -sign);
    result_.solid_of_patch[patch] = state_.decider();
    if (left) state_.add(changes_, sign);
  }
  bool consistent() const;

  const bool labels_;
  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  const CutLines& lines_of_cuts_;
  const Pieces& pieces_;
  const RadialLists& lists_;
  const std::vector<InsideRule>& rules_;
  State state_;
  CellValues result_;
  std::vector<Fingerprint> fingerprints_;
  std::vector<bool> seen_;
  std::vector<std::uint32_t> piece_of_;  // of each patch, one of its pieces
  std::vector<std::uint32_t> group_of_;  // of each patch, one that it is in
  std::vector<bool> left_in_group_;      // whether the patch is on the left there
  detail::Buckets neighbours_;           // of each cell: 2 * patch + (0: seen from its front)
  std::vector<std::uint32_t> seeds_;     // of each component, a cell
  std::vector<Nearby> places_;           // in these cells
  std::vector<SolidCount> changes_;
};

void Walk::find_groups() {
  piece_of_.resize(lists_.patch_count);
  for (std::uint32_t p = 0; p < lists_.patch_of.size(); ++p) {
    if (!pieces_.is_dead(p)) piece_of_[lists_.patch_of[p]] = p;
  }
  group_of_.assign(lists_.patch_count, kNone);
  left_in_group_.assign(lists_.patch_count, false);
  for (std::uint32_t g = 0; g < lists_.groups.size(); ++g) {
    for (const RadialLists::Sheet& sheet : lists_.sheets_of(lists_.groups[g])) {
      const std::uint32_t patch = lists_.patch_of[sheet.piece];
      if (group_of_[patch] != kNone) continue;
      group_of_[patch] = g;
      left_in_group_[patch] = sheet.left;
    }
  }
}

void Walk::find_neighbours() {
  neighbours_ = detail::bucket(std::size_t{2} * lists_.patch_count, lists_.cell_count,
                               [&](std::size_t side) { return lists_.cell_of[side]; });
}

// Each component has a triangle that nothing cuts or an edge. Places at vertices are the simplest.
void Walk::find_seeds() {
  seeds_.assign(lists_.component_count, kNone);
  places_.resize(lists_.component_count);
  std::size_t missing = seeds_.size();
  const auto offer = [&](std::uint32_t piece, const auto& place) {
    const std::uint32_t patch = lists_.patch_of[piece];
    const std::uint32_t component = lists_.component_of[patch];
    if (seeds_[component] != kNone) return;
    seeds_[component] = cell(patch, false);
    places_[component] = place();
    --missing;
  };
  for (std::uint32_t t = 0; t < input_.triangles.size() && missing > 0; ++t) {
    const std::uint32_t* edges = &input_.edges.edge_of[3 * t];
    if (pieces_.is_dead(t) || pieces_.edge_listed[edges[0]] || pieces_.edge_listed[edges[1]] ||
        pieces_.edge_listed[edges[2]]) {
      continue;
    }
    offer(t, [&] { return place_at(t); });
  }
  for (const bool all : {false, true}) {
    for (const AtomicEdge& edge : pieces_.edges) {
      if (missing == 0) break;
      if (edge.a >= input_.vertices.size() && !all) continue;
      for (std::uint32_t u = edge.first_use; u < edge.first_use + edge.use_count; ++u) {
        const EdgeUse& use = pieces_.uses[u];
        const bool left = use.left != EdgeUse::kNoPiece;
        offer(left ? use.left : use.right, [&] { return place_at(edge, use, left); });
      }
    }
  }
}

Nearby Walk::place_at(std::uint32_t t) const {
  const glm::uvec3& c = input_.triangles[t];
  const auto& vertices = input_.vertices;
  const exact::LatticePoint along = vertices[c.y] - vertices[c.x];
  return {t, c.x, {along.x, along.y, along.z}, vertices[c.z] - vertices[c.x]};
}

// At the first end of an edge, on the left or on the right of it.
Nearby Walk::place_at(const AtomicEdge& edge, const EdgeUse& use, bool left) const {
  Nearby place{use.triangle, edge.a, direction_of(input_, lines_of_cuts_, use.line), {}};
  if (!use.forward) place.along = {-place.along[0], -place.along[1], -place.along[2]};
  const exact::PlaneView view(input_.plane_of(use.triangle));
  const exact::PlanarDirection along{place.along[static_cast<std::size_t>(view.u())],
                                     place.along[static_cast<std::size_t>(view.v())]};
  const glm::uvec3& c = input_.triangles[use.triangle];
  for (int k = 0; k < 2; ++k) {  // two sides of the triangle are not parallel to the edge
    place.across = input_.vertices[c[k + 1]] - input_.vertices[c[k]];
    const int turn = exact::turn_in_plane(along, view.of(place.across));
    if (turn == 0) continue;
    if ((turn > 0) != left) place.across = -place.across;
    break;
  }
  return place;
}

// Counter-clockwise through a group: out of what has its front behind.
void Walk::changes_of(const RadialLists::Group& group) {
  changes_.clear();
  for (const RadialLists::Sheet& sheet : lists_.sheets_of(group)) {
    const int sign = sheet.left ? -1 : 1;
    for (const auto& [solid, count] : input_.solids.content(pieces_.triangle_of[sheet.piece])) {
      changes_.push_back({solid, sign * count});
    }
  }
  if (changes_.size() > 1) merge_counts(changes_);
}

// From the back of a patch to its front.
void Walk::changes_of(std::uint32_t patch) {
  if (group_of_[patch] == kNone) {  // a shell that nothing meets
    changes_.clear();
    for (const auto& [solid, count] :
         input_.solids.content(pieces_.triangle_of[piece_of_[patch]])) {
      changes_.push_back({solid, -count});
    }
    return;
  }
  changes_of(lists_.groups[group_of_[patch]]);
  if (left_in_group_[patch]) return;
  for (SolidCount& change : changes_) change.count = -change.count;
}

void Walk::enter(std::uint32_t cell) {
  seen_[cell] = true;
  result_.inside[cell] = state_.value();
  fingerprints_[cell] = state_.fingerprint();
}

void Walk::walk_from(std::uint32_t start) {
  enter(start);
  struct Step {
    std::uint32_t cell, next;  // of its neighbours
    std::uint32_t came;        // through this side
  };
  std::vector<Step> path{{start, neighbours_.first[start], kNone}};
  while (!path.empty()) {
    Step& step = path.back();
    if (step.next == neighbours_.first[step.cell + 1]) {
      if (step.came != kNone) {  // back through the patch
        changes_of(step.came / 2);
        state_.add(changes_, step.came % 2 == 0 ? 1 : -1);
      }
      path.pop_back();
      continue;
    }
    const std::uint32_t side = neighbours_.items[step.next++], patch = side / 2;
    const bool at_front = side % 2 == 0;
    const std::uint32_t to = cell(patch, at_front);
    if (seen_[to] && !wants_label(patch)) continue;
    changes_of(patch);
    const int sign = at_front ? -1 : 1;
    state_.add(changes_, sign);
    if (state_.value() != result_.inside[step.cell]) label(patch, sign);
    if (seen_[to]) {
      state_.add(changes_, -sign);
      continue;
    }
    enter(to);
    path.push_back({to, neighbours_.first[to], side});
  }
}

bool Walk::consistent() const {
  for (const RadialLists::Group& group : lists_.groups) {
    Fingerprint behind = fingerprints_[lists_.cell_before(group)];
    for (const RadialLists::Sheet& sheet : lists_.sheets_of(group)) {
      for (const auto& [solid, count] : input_.solids.content(pieces_.triangle_of[sheet.piece])) {
        behind.change(rules_[solid], solid, sheet.left ? -count : count);
      }
    }
    if (!(behind == fingerprints_[lists_.cell_behind(group)])) return false;
  }
  return true;
}

Result<CellValues> Walk::run(const Execution& execution) {
  find_groups();
  find_neighbours();
  find_seeds();
  const auto windings = count_windings(input_, points_, places_, execution);
  if (!windings) return tl::unexpected(windings.error());
  for (std::size_t i = 0; i < seeds_.size(); ++i) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    assert(seeds_[i] != kNone);
    state_.add((*windings)[i], 1);
    walk_from(seeds_[i]);
    state_.add((*windings)[i], -1);
  }
  if (!consistent()) {
    return fail(ErrorCode::kGeometry,
                "the winding numbers around an edge contradict each other; is a solid open?");
  }
  return std::move(result_);
}

}  // namespace

Result<CellValues> find_cell_values(const ArrangementInput& input, const BoundaryPoints& points,
                                    const CutLines& lines_of_cuts, const Pieces& pieces,
                                    const RadialLists& lists, const Program& program,
                                    const std::vector<InsideRule>& rules, bool labels,
                                    const Execution& execution) {
  return Walk(input, points, lines_of_cuts, pieces, lists, program, rules, labels).run(execution);
}

}  // namespace strata::csg
