#include "csg/arrangement/pieces.h"

#include <algorithm>

#include "core/buckets.h"
#include "exact/directions.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;
using exact::PlanarDirection;

struct Record {
  std::uint32_t a, b;
  EdgeUse use;
};

// Collects the atomic edges and which triangles have them.
class EdgeCollector {
 public:
  EdgeCollector(const ArrangementInput& input, const BoundaryPoints& points, const CutLines& lines,
                const SortedLines& sorted)
      : input_(input), points_(points), lines_(lines), sorted_(sorted) {}

  void run(Pieces& pieces, std::vector<bool>& cut, const Execution& execution) {
    find_cut_triangles(cut);
    records_.reserve(sorted_.points.size() + 2 * lines_.cuts.size());
    list_edges(pieces, cut);
    for (const CutLines::Cut& c : lines_.cuts) add_cut(c);
    sort_records(pieces, execution);
  }

 private:
  void find_cut_triangles(std::vector<bool>& cut) const {
    cut.assign(input_.triangles.size(), false);
    for (const CutLines::Cut& c : lines_.cuts) cut[c.triangle] = true;
    for (std::uint32_t edge = 0; edge < input_.edges.size(); ++edge) {
      if (sorted_.of(edge).size() <= 2) continue;
      for (const std::uint32_t use : input_.edges.uses_of(edge)) cut[use / 3] = true;
    }
  }

  // Whether two triangles of the same solids continue each other across a mesh edge.
  bool continues(std::span<const std::uint32_t> uses) const {
    return to_and_fro(input_.triangles, uses) &&
           input_.solids.content_of[uses[0] / 3] == input_.solids.content_of[uses[1] / 3];
  }

  void list_edges(Pieces& pieces, const std::vector<bool>& cut) {
    pieces.edge_listed.assign(input_.edges.size(), false);
    for (std::uint32_t edge = 0; edge < input_.edges.size(); ++edge) {
      const auto uses = input_.edges.uses_of(edge);
      const bool listed = lines_.touched[edge] || !continues(uses) ||
                          std::ranges::any_of(uses, [&](std::uint32_t u) { return cut[u / 3]; });
      if (!listed) continue;
      pieces.edge_listed[edge] = true;
      for (const std::uint32_t use : uses) {
        const std::uint32_t ends[2] = {input_.edge_from(edge), input_.edge_to(edge)};
        const auto list = sorted_.of(edge);
        add_chain(list.empty() ? std::span<const std::uint32_t>(ends) : list, edge, use / 3,
                  static_cast<std::uint8_t>(use % 3));
      }
    }
  }

  void add_chain(std::span<const std::uint32_t> list, std::uint32_t line, std::uint32_t triangle,
                 std::uint8_t side) {
    for (std::size_t i = 1; i < list.size(); ++i) {
      const bool forward = list[i - 1] < list[i];
      const auto [a, b] = std::minmax(list[i - 1], list[i]);
      records_.push_back(
          {a, b, {triangle, line, EdgeUse::kNoPiece, EdgeUse::kNoPiece, side, forward}});
    }
  }

  void add_cut(const CutLines::Cut& cut) {
    const auto list = sorted_.of(cut.line);
    const auto at = [&](std::uint32_t point) {
      if (list.size() < 32) {
        return static_cast<std::size_t>(std::ranges::find(list, point) - list.begin());
      }
      const LineAxis along = axis_of(input_, lines_, cut.line);
      const int up = along.rising ? -1 : 1;
      const auto found =
          std::ranges::lower_bound(list, point, [&](std::uint32_t x, std::uint32_t y) {
            return x != y && order_along(points_, x, y, along.axis) == up;
          });
      assert(found != list.end() && *found == point);
      return static_cast<std::size_t>(found - list.begin());
    };
    const std::size_t from = at(cut.from), to = at(cut.to);
    const auto [first, last] = std::minmax(from, to);
    add_chain(list.subspan(first, last - first + 1), cut.line, cut.triangle, EdgeUse::kInside);
  }

  // What one thread makes of the records of some points.
  struct Part {
    std::vector<AtomicEdge> edges;
    std::vector<EdgeUse> uses;
  };

  // Edges in the order of their points, with their triangles in order; each triangle once.
  void sort_records(Pieces& pieces, const Execution& execution) {
    constexpr std::size_t kBlock = 4096;
    const detail::Buckets buckets = detail::bucket(records_.size(), points_.size(),
                                                   [&](std::size_t i) { return records_[i].a; });
    std::vector<Part> parts((points_.size() + kBlock - 1) / kBlock);
    parallel_for(execution, parts.size(), [&](std::size_t block, int) {
      std::vector<Record> around;
      const std::size_t end = std::min(points_.size(), (block + 1) * kBlock);
      for (std::size_t a = block * kBlock; a < end; ++a) {
        around.clear();
        for (std::uint32_t i = buckets.first[a]; i < buckets.first[a + 1]; ++i) {
          around.push_back(records_[buckets.items[i]]);
        }
        std::ranges::sort(around, [](const Record& x, const Record& y) {
          return std::tie(x.b, x.use.triangle, x.use.side, x.use.line) <
                 std::tie(y.b, y.use.triangle, y.use.side, y.use.line);
        });
        for (const Record& record : around) add_use(parts[block], record);
      }
    });
    records_ = {};
    std::size_t edges = 0, uses = 0;
    for (const Part& part : parts) {
      edges += part.edges.size();
      uses += part.uses.size();
    }
    pieces.edges.reserve(edges);
    pieces.uses.reserve(uses);
    for (Part& part : parts) {
      const auto before = static_cast<std::uint32_t>(pieces.uses.size());
      for (AtomicEdge& edge : part.edges) edge.first_use += before;
      pieces.edges.insert(pieces.edges.end(), part.edges.begin(), part.edges.end());
      pieces.uses.insert(pieces.uses.end(), part.uses.begin(), part.uses.end());
      part = {};
    }
  }

  static void add_use(Part& part, const Record& record) {
    auto& edges = part.edges;
    const bool same_edge =
        !edges.empty() && edges.back().a == record.a && edges.back().b == record.b;
    if (!same_edge) {
      edges.push_back({record.a, record.b, static_cast<std::uint32_t>(part.uses.size()), 0});
    } else if (part.uses.back().triangle == record.use.triangle &&
               part.uses.back().side == record.use.side) {
      return;
    }
    ++edges.back().use_count;
    part.uses.push_back(record.use);
  }

  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  const CutLines& lines_;
  const SortedLines& sorted_;
  std::vector<Record> records_;
};

// Walks around the pieces of one triangle after the other.
class Subdivider {
 public:
  // Numbers of pieces from kOwn on are those in `added`, which has their triangles.
  static constexpr std::uint32_t kOwn = 0x80000000u;

  Subdivider(const ArrangementInput& input, const CutLines& lines, Pieces& pieces,
             const std::vector<std::uint32_t>& edge_of_use, std::vector<std::uint32_t>& added)
      : input_(input), lines_(lines), pieces_(pieces), edge_of_use_(edge_of_use), added_(added) {}

  void run(std::uint32_t triangle, std::span<const std::uint32_t> uses) {
    triangle_ = triangle;
    spokes_.clear();
    for (const std::uint32_t use : uses) {
      const AtomicEdge& edge = pieces_.edges[edge_of_use_[use]];
      const bool inside = pieces_.uses[use].side == EdgeUse::kInside;
      const bool leaves_a = inside || runs_with_triangle(use);
      spokes_.push_back({edge.a, use, true, leaves_a, kOpen});
      spokes_.push_back({edge.b, use, false, inside || !leaves_a, kOpen});
    }
    sort_spokes();
    first_piece_ = true;
    for (std::uint32_t s = 0; s < spokes_.size(); ++s) {
      if (spokes_[s].leaves && spokes_[s].piece == kOpen) walk(s);
    }
  }

 private:
  static constexpr std::uint32_t kOpen = EdgeUse::kNoPiece;

  // An edge at one of its points.
  struct Spoke {
    std::uint32_t point, use;
    bool at_a;
    bool leaves;          // a half-edge with the triangle on its left begins here
    std::uint32_t piece;  // on the left of that half-edge
  };

  // Whether the side of the triangle that the edge lies along runs from a to b.
  bool runs_with_triangle(std::uint32_t use) const {
    const EdgeUse& u = pieces_.uses[use];
    const std::uint32_t from = input_.corner(3 * u.triangle + u.side, 0);
    return u.forward == (from == input_.edge_from(input_.edges.edge_of[3 * u.triangle + u.side]));
  }

  PlanarDirection direction(const exact::PlaneView& view, const Spoke& spoke) const;
  void sort_spokes();
  void sort_around(std::uint32_t begin, std::uint32_t end);
  void walk(std::uint32_t start);

  const ArrangementInput& input_;
  const CutLines& lines_;
  Pieces& pieces_;
  const std::vector<std::uint32_t>& edge_of_use_;
  std::vector<std::uint32_t>& added_;
  std::uint32_t triangle_ = 0;
  bool first_piece_ = true;
  std::vector<Spoke> spokes_;
  std::vector<std::uint64_t> order_;        // point << 32 | spoke, sorted; then around each point
  std::vector<std::uint32_t> place_;        // of each spoke in the order
  std::vector<std::uint32_t> begin_, end_;  // at each place, of those at the same point
  std::vector<std::pair<PlanarDirection, std::uint64_t>> around_;
};

PlanarDirection Subdivider::direction(const exact::PlaneView& view, const Spoke& spoke) const {
  const EdgeUse& use = pieces_.uses[spoke.use];
  bool along = spoke.at_a == use.forward;  // whether the line runs away from the point
  PlanarDirection result;
  if (use.line < input_.edges.size()) {
    result = view.of(input_.vertices[input_.edge_to(use.line)] -
                     input_.vertices[input_.edge_from(use.line)]);
  } else {
    const CrossingLine& crossing = lines_.crossings[use.line - input_.edges.size()];
    const bool is_first = crossing.first == triangle_;
    result = view.of(input_.plane_of(is_first ? crossing.second : crossing.first));
    along = along == is_first;
  }
  return along ? result : PlanarDirection{-result.u, -result.v};
}

// Spokes come in pairs, one for each end of an edge: 2 i and 2 i + 1 before they are sorted.
void Subdivider::sort_spokes() {
  const auto count = static_cast<std::uint32_t>(spokes_.size());
  order_.resize(count);
  for (std::uint32_t s = 0; s < count; ++s) {
    order_[s] = std::uint64_t{spokes_[s].point} << 32 | s;
  }
  std::ranges::sort(order_);
  place_.resize(count);
  begin_.resize(count);
  end_.resize(count);
  for (std::uint32_t begin = 0; begin < count;) {
    std::uint32_t end = begin + 1;
    while (end < count && order_[end] >> 32 == order_[begin] >> 32) ++end;
    if (end - begin > 2) sort_around(begin, end);
    for (std::uint32_t at = begin; at < end; ++at) {
      place_[static_cast<std::uint32_t>(order_[at])] = at;
      begin_[at] = begin;
      end_[at] = end;
    }
    begin = end;
  }
}

// Counter-clockwise, as seen from the front of the triangle: from the side that leaves, if there is
// one, over those inside to the side that arrives.
void Subdivider::sort_around(std::uint32_t begin, std::uint32_t end) {
  const auto rank = [&](std::uint64_t at) {
    const Spoke& spoke = spokes_[static_cast<std::uint32_t>(at)];
    if (pieces_.uses[spoke.use].side == EdgeUse::kInside) return 1;
    return spoke.leaves ? 0 : 2;
  };
  const auto first = order_.begin() + begin, last = order_.begin() + end;
  std::stable_sort(first, last, [&](auto x, auto y) { return rank(x) < rank(y); });
  const auto inside = std::find_if(first, last, [&](auto at) { return rank(at) > 0; });
  const auto arriving = std::find_if(inside, last, [&](auto at) { return rank(at) > 1; });
  if (arriving - inside < 2) return;
  const exact::PlaneView view(input_.plane_of(triangle_));
  around_.clear();
  for (auto at = first; at != arriving; ++at) {
    around_.emplace_back(direction(view, spokes_[static_cast<std::uint32_t>(*at)]), *at);
  }
  const PlanarDirection from = around_.front().first;
  std::sort(around_.begin() + (inside - first), around_.end(), [&](const auto& x, const auto& y) {
    return exact::order_in_plane(from, x.first, y.first) < 0;
  });
  for (std::size_t i = 0; i < around_.size(); ++i)
    first[static_cast<std::ptrdiff_t>(i)] = around_[i].second;
}

// Along the half-edge that leaves at a spoke, then at each point to the next spoke clockwise.
void Subdivider::walk(std::uint32_t start) {
  std::uint32_t piece = triangle_;
  if (!first_piece_) {
    piece = kOwn + static_cast<std::uint32_t>(added_.size());
    added_.push_back(triangle_);
  }
  first_piece_ = false;
  for (std::uint32_t s = start; spokes_[s].piece == kOpen;) {
    spokes_[s].piece = piece;
    EdgeUse& use = pieces_.uses[spokes_[s].use];
    (spokes_[s].at_a ? use.left : use.right) = piece;
    const std::uint32_t arrived = place_[s ^ 1];
    const std::uint32_t next = (arrived == begin_[arrived] ? end_[arrived] : arrived) - 1;
    s = static_cast<std::uint32_t>(order_[next]);
    if (!spokes_[s].leaves) return;  // only where a line ends within a triangle: it is open
  }
}

// Leaves of the pieces what lies in the zone.
class DeadPieces {
 public:
  DeadPieces(const ArrangementInput& input, const BoundaryPoints& points, Pieces& pieces)
      : input_(input), points_(points), pieces_(pieces) {}

  void drop(const Execution& execution) {
    pieces_.dead.assign(pieces_.triangle_of.size(), 0);
    const std::vector<std::uint8_t> edge_dead = dead_edges(execution);
    for (std::uint32_t e = 0; e < pieces_.edges.size(); ++e) {
      if (edge_dead[e] == 0) continue;
      const AtomicEdge& edge = pieces_.edges[e];
      for (std::uint32_t u = edge.first_use; u < edge.first_use + edge.use_count; ++u) {
        mark(pieces_.uses[u].left);
        mark(pieces_.uses[u].right);
      }
    }
    mark_uncut();
    keep_edges(edge_dead);
  }

 private:
  void mark(std::uint32_t piece) {
    if (piece != EdgeUse::kNoPiece) pieces_.dead[piece] = 1;
  }

  std::vector<std::uint8_t> dead_edges(const Execution& execution) const {
    constexpr std::size_t kBlock = 4096;
    std::vector<std::uint8_t> result(pieces_.edges.size());
    parallel_for(execution, (result.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
      const std::size_t end = std::min(result.size(), (block + 1) * kBlock);
      for (std::size_t e = block * kBlock; e < end; ++e) {
        const AtomicEdge& edge = pieces_.edges[e];
        result[e] = !input_.zone.contains(points_.rounded(edge.a), points_.rounded(edge.b));
      }
    });
    return result;
  }

  void mark_uncut() {
    for (std::uint32_t edge = 0; edge < input_.edges.size(); ++edge) {
      if (pieces_.edge_listed[edge]) continue;
      const auto uses = input_.edges.uses_of(edge);
      std::uint8_t &s = pieces_.dead[uses[0] / 3], &t = pieces_.dead[uses[1] / 3];
      if ((s & t) != 0) continue;
      if (!input_.zone.contains(points_.rounded(input_.edge_from(edge)),
                                points_.rounded(input_.edge_to(edge)))) {
        s = t = 1;
      }
    }
  }

  void keep_edges(const std::vector<std::uint8_t>& edge_dead) {
    std::size_t edges = 0;
    std::uint32_t uses = 0;
    const auto own_piece = [&](std::uint32_t piece) {
      if (piece == EdgeUse::kNoPiece || !pieces_.is_dead(piece)) return piece;
      pieces_.triangle_of.push_back(std::uint32_t{pieces_.triangle_of[piece]});
      pieces_.dead.push_back(0);
      return static_cast<std::uint32_t>(pieces_.triangle_of.size() - 1);
    };
    for (std::size_t e = 0; e < edge_dead.size(); ++e) {
      if (edge_dead[e] != 0) continue;
      AtomicEdge edge = pieces_.edges[e];
      const std::uint32_t first = std::exchange(edge.first_use, uses);
      for (std::uint32_t u = first; u < first + edge.use_count; ++u) {
        EdgeUse use = pieces_.uses[u];
        use.left = own_piece(use.left);
        use.right = own_piece(use.right);
        pieces_.uses[uses++] = use;
      }
      pieces_.edges[edges++] = edge;
    }
    pieces_.edges.resize(edges);
    pieces_.uses.resize(uses);
  }

  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  Pieces& pieces_;
};

}  // namespace

Result<Pieces> find_pieces(const ArrangementInput& input, const BoundaryPoints& points,
                           const CutLines& lines, const SortedLines& sorted,
                           const Execution& execution) {
  Pieces pieces;
  std::vector<bool> cut;
  EdgeCollector(input, points, lines, sorted).run(pieces, cut, execution);
  const std::size_t triangle_count = input.triangles.size();
  pieces.triangle_of.resize(triangle_count);
  std::iota(pieces.triangle_of.begin(), pieces.triangle_of.end(), std::uint32_t{0});
  std::vector<std::uint32_t> edge_of_use(pieces.uses.size());
  for (std::uint32_t e = 0; e < pieces.edges.size(); ++e) {
    const AtomicEdge& edge = pieces.edges[e];
    std::fill_n(edge_of_use.begin() + edge.first_use, edge.use_count, e);
  }
  const detail::Buckets by_triangle = detail::bucket(
      pieces.uses.size(), triangle_count, [&](std::size_t u) { return pieces.uses[u].triangle; });
  const auto uses_of = [&](std::uint32_t t) {
    return std::span(by_triangle.items)
        .subspan(by_triangle.first[t], by_triangle.first[t + 1] - by_triangle.first[t]);
  };
  std::vector<std::uint32_t> cut_triangles;
  for (std::uint32_t t = 0; t < triangle_count; ++t) {
    if (cut[t]) {
      cut_triangles.push_back(t);
      continue;
    }
    for (const std::uint32_t u : uses_of(t)) {  // sides of a triangle that is one piece
      EdgeUse& use = pieces.uses[u];
      const bool forward = input.corner(3 * t + use.side, 0) == pieces.edges[edge_of_use[u]].a;
      (forward ? use.left : use.right) = t;
    }
  }
  constexpr std::size_t kBlock = 512;
  const std::size_t blocks = (cut_triangles.size() + kBlock - 1) / kBlock;
  std::vector<std::vector<std::uint32_t>> added(blocks);  // triangles of further pieces
  const auto block_of = [&](std::size_t block) {
    const std::size_t begin = block * kBlock;
    return std::span(cut_triangles).subspan(begin, std::min(kBlock, cut_triangles.size() - begin));
  };
  parallel_for(execution, blocks, [&](std::size_t block, int) {
    Subdivider subdivider(input, lines, pieces, edge_of_use, added[block]);
    for (const std::uint32_t t : block_of(block)) subdivider.run(t, uses_of(t));
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  std::vector<std::uint32_t> before;
  for (const std::vector<std::uint32_t>& some : added) {
    before.push_back(static_cast<std::uint32_t>(pieces.triangle_of.size()));
    pieces.triangle_of.insert(pieces.triangle_of.end(), some.begin(), some.end());
  }
  parallel_for(execution, blocks, [&](std::size_t block, int) {
    for (const std::uint32_t t : block_of(block)) {
      for (const std::uint32_t u : uses_of(t)) {
        for (std::uint32_t* piece : {&pieces.uses[u].left, &pieces.uses[u].right}) {
          if (*piece != EdgeUse::kNoPiece && *piece >= Subdivider::kOwn) {
            *piece = *piece - Subdivider::kOwn + before[block];
          }
        }
      }
    }
  });
  if (!input.zone.everywhere()) DeadPieces(input, points, pieces).drop(execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return pieces;
}

}  // namespace strata::csg
