#include "csg/arrangement/cell_values.h"

#include <algorithm>

#include "csg/arrangement/buckets.h"
#include "csg/arrangement/winding_rays.h"

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
  Walk(const ArrangementInput& input, const Pieces& pieces, const RadialLists& lists,
       const Program& program, const std::vector<InsideRule>& rules, bool labels)
      : labels_(labels),
        input_(input),
        pieces_(pieces),
        lists_(lists),
        rules_(rules),
        state_(program, rules),
        windings_(rules.size(), 0) {
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
  void changes_of(std::uint32_t patch);
  void changes_of(const RadialLists::Group& group);
  void merge_changes();
  void walk_from(std::uint32_t cell);
  void enter(std::uint32_t cell);
  bool wants_label(std::uint32_t patch) const {
    return labels_ && result_.solid_of_patch[patch] == kNone;
  }
  // The tree's value has just changed in going through a patch.
  void label(std::uint32_t patch) {
    if (wants_label(patch)) result_.solid_of_patch[patch] = state_.decider();
  }
  bool consistent() const;

  const bool labels_;
  const ArrangementInput& input_;
  const Pieces& pieces_;
  const RadialLists& lists_;
  const std::vector<InsideRule>& rules_;
  State state_;
  std::vector<std::int32_t> windings_;
  CellValues result_;
  std::vector<Fingerprint> fingerprints_;
  std::vector<bool> seen_;
  std::vector<std::uint32_t> piece_of_;  // of each patch, one of its pieces
  std::vector<std::uint32_t> group_of_;  // of each patch, one that it is in
  std::vector<bool> left_in_group_;      // whether the patch is on the left there
  Buckets neighbours_;                   // of each cell: 2 * patch + (0: seen from its front)
  struct Seed {
    Nearby place;
    std::uint32_t cell = kNone;
  };
  std::vector<Seed> seeds_;  // of each component
  std::vector<SolidCount> changes_;
};

void Walk::find_groups() {
  piece_of_.resize(lists_.patch_count);
  for (std::uint32_t p = 0; p < lists_.patch_of.size(); ++p) piece_of_[lists_.patch_of[p]] = p;
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
  neighbours_ = bucket(std::size_t{2} * lists_.patch_count, lists_.cell_count,
                       [&](std::size_t side) { return lists_.cell_of[side]; });
}

// A component has a side of a triangle that begins or ends at a corner: its edges go on until they
// do.
void Walk::find_seeds() {
  seeds_.resize(lists_.component_count);
  const auto offer = [&](std::uint32_t piece, const Nearby& place) {
    const std::uint32_t patch = lists_.patch_of[piece];
    Seed& seed = seeds_[lists_.component_of[patch]];
    if (seed.cell == kNone) seed = {place, cell(patch, false)};
  };
  for (std::uint32_t t = 0; t < input_.triangles.size(); ++t) {
    const std::uint32_t* edges = &input_.edges.edge_of[3 * t];
    if (pieces_.edge_listed[edges[0]] || pieces_.edge_listed[edges[1]] ||
        pieces_.edge_listed[edges[2]]) {
      continue;
    }
    const glm::uvec3& c = input_.triangles[t];
    offer(t, {t, c.x, c.y, c.z});
  }
  for (const AtomicEdge& edge : pieces_.edges) {
    for (std::uint32_t u = edge.first_use; u < edge.first_use + edge.use_count; ++u) {
      const EdgeUse& use = pieces_.uses[u];
      if (use.side == EdgeUse::kInside) continue;
      const std::uint32_t side = 3 * use.triangle + use.side;
      const std::uint32_t v = input_.corner(side, 0), w = input_.corner(side, 1),
                          third = input_.corner(side, 2);
      const std::uint32_t piece = use.left != EdgeUse::kNoPiece ? use.left : use.right;
      if (edge.a == v || edge.b == v) offer(piece, {use.triangle, v, w, third});
      if (edge.a == w || edge.b == w) offer(piece, {use.triangle, w, v, third});
    }
  }
}

void Walk::merge_changes() {
  if (changes_.size() < 2) return;
  std::ranges::sort(changes_, {}, &SolidCount::solid);
  std::size_t kept = 0;
  for (std::size_t i = 1; i < changes_.size(); ++i) {
    if (changes_[i].solid == changes_[kept].solid) {
      changes_[kept].count += changes_[i].count;
    } else {
      changes_[++kept] = changes_[i];
    }
  }
  changes_.resize(kept + 1);
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
  merge_changes();
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
    state_.add(changes_, at_front ? -1 : 1);
    if (state_.value() != result_.inside[step.cell]) label(patch);
    if (seen_[to]) {
      state_.add(changes_, at_front ? 1 : -1);
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
  const WindingRays rays(input_, lists_.component_count);
  std::vector<SolidCount> start;
  for (const Seed& seed : seeds_) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    assert(seed.cell != kNone);
    std::ranges::fill(windings_, 0);
    rays.count(seed.place, windings_);
    start.clear();
    for (std::uint32_t s = 0; s < windings_.size(); ++s) {
      if (windings_[s] != 0) start.push_back({s, windings_[s]});
    }
    state_.add(start, 1);
    walk_from(seed.cell);
    state_.add(start, -1);
  }
  if (!consistent()) {
    return fail(ErrorCode::kGeometry,
                "the winding numbers around an edge contradict each other; is a solid open?");
  }
  return std::move(result_);
}

}  // namespace

Result<CellValues> find_cell_values(const ArrangementInput& input, const Pieces& pieces,
                                    const RadialLists& lists, const Program& program,
                                    const std::vector<InsideRule>& rules, bool labels,
                                    const Execution& execution) {
  return Walk(input, pieces, lists, program, rules, labels).run(execution);
}

}  // namespace strata::csg
