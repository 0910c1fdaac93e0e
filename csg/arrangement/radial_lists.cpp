#include "csg/arrangement/radial_lists.h"

#include <algorithm>

#include "exact/directions.h"
#include "mesh/disjoint_sets.h"

namespace strata::csg {
namespace {

using exact::Normal;
using Sheet = RadialLists::Sheet;

// What one thread finds: lists of edges in order, and pieces that continue each other.
struct Part {
  std::vector<RadialLists::Edge> edges;
  std::vector<RadialLists::Group> groups;
  std::vector<Sheet> sheets;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
};

class EdgeSorter {
 public:
  EdgeSorter(const ArrangementInput& input, const CutLines& lines, const Pieces& pieces, Part& out)
      : input_(input), lines_(lines), pieces_(pieces), out_(out) {}

  void add_edge(std::uint32_t e);

 private:
  void sort_groups(const AtomicEdge& edge);
  // The direction from a to b.
  exact::TurningAxis axis(const EdgeUse& use) const {
    const auto [axis, rising] = axis_of(input_, lines_, use.line);
    return {axis, rising == use.forward ? 1 : -1};
  }

  const ArrangementInput& input_;
  const CutLines& lines_;
  const Pieces& pieces_;
  Part& out_;
  std::vector<std::pair<Normal, Sheet>> around_;
};

void EdgeSorter::add_edge(std::uint32_t e) {
  const AtomicEdge& edge = pieces_.edges[e];
  around_.clear();
  for (std::uint32_t u = edge.first_use; u < edge.first_use + edge.use_count; ++u) {
    const EdgeUse& use = pieces_.uses[u];
    for (const bool left : {true, false}) {
      const std::uint32_t piece = left ? use.left : use.right;
      if (piece != EdgeUse::kNoPiece) around_.push_back({Normal(0), {piece, left}});
    }
  }
  if (around_.size() == 2) {
    const Sheet &first = around_[0].second, &second = around_[1].second;
    const std::uint32_t s = pieces_.triangle_of[first.piece], t = pieces_.triangle_of[second.piece];
    if (first.left != second.left && input_.solids.content_of[s] == input_.solids.content_of[t]) {
      out_.joined.emplace_back(first.piece, second.piece);
      return;
    }
  }
  for (auto& [normal, sheet] : around_) {
    normal = input_.plane_of(pieces_.triangle_of[sheet.piece]).normal;
    if (!sheet.left) normal = -normal;
  }
  out_.edges.push_back({e, static_cast<std::uint32_t>(out_.groups.size()), 0});
  sort_groups(edge);
}

void EdgeSorter::sort_groups(const AtomicEdge& edge) {
  const exact::SheetOrder order(axis(pieces_.uses[edge.first_use]), around_.front().first);
  const auto before = [&](const auto& x, const auto& y) { return order(x.first, y.first) < 0; };
  if (around_.size() < 16) {  // by insertion: equal ones stay in order
    for (auto at = around_.begin() + 1; at != around_.end(); ++at) {
      std::rotate(std::upper_bound(around_.begin(), at, *at, before), at, at + 1);
    }
  } else {
    std::ranges::stable_sort(around_, before);
  }
  for (std::size_t i = 0; i < around_.size(); ++i) {
    if (i == 0 || order(around_[i - 1].first, around_[i].first) != 0) {
      out_.groups.push_back({static_cast<std::uint32_t>(out_.sheets.size()), 0});
      ++out_.edges.back().group_count;
    }
    ++out_.groups.back().sheet_count;
    out_.sheets.push_back(around_[i].second);
  }
}

class RadialSorter {
 public:
  RadialSorter(const ArrangementInput& input, const CutLines& lines, const Pieces& pieces)
      : input_(input), lines_(lines), pieces_(pieces), patches_(pieces.triangle_of.size()) {}

  Result<RadialLists> run(const Execution& execution) {
    constexpr std::size_t kBlock = 4096;
    std::vector<Part> parts((pieces_.edges.size() + kBlock - 1) / kBlock);
    parallel_for(execution, parts.size(), [&](std::size_t part, int) {
      EdgeSorter sorter(input_, lines_, pieces_, parts[part]);
      const std::size_t end = std::min(pieces_.edges.size(), (part + 1) * kBlock);
      for (std::size_t e = part * kBlock; e < end; ++e) {
        sorter.add_edge(static_cast<std::uint32_t>(e));
      }
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    for (Part& part : parts) append(part);
    join_uncut();
    number_patches();
    join_cells();
    return std::move(result_);
  }

 private:
  void append(Part& part) {
    const auto groups = static_cast<std::uint32_t>(result_.groups.size()),
               sheets = static_cast<std::uint32_t>(result_.sheets.size());
    for (RadialLists::Edge edge : part.edges) {
      edge.first_group += groups;
      result_.edges.push_back(edge);
    }
    for (RadialLists::Group group : part.groups) {
      group.first_sheet += sheets;
      result_.groups.push_back(group);
    }
    result_.sheets.insert(result_.sheets.end(), part.sheets.begin(), part.sheets.end());
    for (const auto& [piece, other] : part.joined) patches_.join(piece, other);
    part = {};
  }

  void join_uncut() {
    for (std::uint32_t edge = 0; edge < input_.edges.size(); ++edge) {
      if (pieces_.edge_listed[edge]) continue;
      const auto uses = input_.edges.uses_of(edge);
      const std::uint32_t s = uses[0] / 3, t = uses[1] / 3;
      if (!pieces_.is_dead(s) && !pieces_.is_dead(t)) patches_.join(s, t);
    }
  }

  void number_patches();
  void join_cells();

  const ArrangementInput& input_;
  const CutLines& lines_;
  const Pieces& pieces_;
  detail::DisjointSets patches_;
  RadialLists result_;
};

// Numbers the sets of items from 0; items that are skipped have sets of their own.
template <class Skip>
std::uint32_t number_sets(detail::DisjointSets& sets, std::size_t count,
                          std::vector<std::uint32_t>& number_of, const Skip& skip) {
  number_of.resize(count);
  std::uint32_t next = 0;
  for (std::uint32_t i = 0; i < count; ++i) {  // the least item represents its set
    if (skip(i)) continue;
    const std::uint32_t root = sets.find(i);
    number_of[i] = root == i ? next++ : number_of[root];
  }
  return next;
}

void RadialSorter::number_patches() {
  result_.patch_count = number_sets(patches_, pieces_.triangle_of.size(), result_.patch_of,
                                    [&](std::uint32_t p) { return pieces_.is_dead(p); });
}

void RadialSorter::join_cells() {
  detail::DisjointSets cells(std::size_t{2} * result_.patch_count);
  detail::DisjointSets components(result_.patch_count);
  const auto side = [&](const Sheet& sheet, bool behind) {
    return 2 * result_.patch_of[sheet.piece] + (sheet.left == behind ? 0u : 1u);
  };
  for (const RadialLists::Edge& edge : result_.edges) {
    const auto groups = std::span(result_.groups).subspan(edge.first_group, edge.group_count);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto sheets = result_.sheets_of(groups[g]);
      for (const Sheet& sheet : sheets.subspan(1)) {
        cells.join(side(sheets[0], false), side(sheet, false));
        cells.join(side(sheets[0], true), side(sheet, true));
        components.join(result_.patch_of[sheets[0].piece], result_.patch_of[sheet.piece]);
      }
      const Sheet& following = result_.sheets_of(groups[(g + 1) % groups.size()])[0];
      cells.join(side(sheets[0], true), side(following, false));
      components.join(result_.patch_of[sheets[0].piece], result_.patch_of[following.piece]);
    }
  }
  const auto none = [](std::uint32_t) { return false; };
  result_.component_count =
      number_sets(components, result_.patch_count, result_.component_of, none);
  result_.cell_count =
      number_sets(cells, std::size_t{2} * result_.patch_count, result_.cell_of, none);
}

}  // namespace

Result<RadialLists> find_radial_lists(const ArrangementInput& input, const CutLines& lines,
                                      const Pieces& pieces, const Execution& execution) {
  return RadialSorter(input, lines, pieces).run(execution);
}

}  // namespace strata::csg
