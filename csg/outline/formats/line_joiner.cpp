#include "csg/outline/formats/line_joiner.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <set>
#include <unordered_map>

namespace strata::csg {
namespace {

using Index = std::uint32_t;

/// The ends of lines, in groups that are taken as one point each.
class Points {
 public:
  explicit Points(const std::stop_token& stop) : stop_(stop) {}

  void add(const glm::dvec2& p, double reach) {
    places_.push_back(p + 0.0);  // no negative zero
    reaches_.push_back(reach);
  }

  /// Unites ends that have the same coordinates.
  void group_equal() {
    std::vector<Index> order(places_.size());
    std::iota(order.begin(), order.end(), Index{0});
    groups_ = order;
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
      const glm::dvec2 &p = places_[a], &q = places_[b];
      return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : a < b;
    });
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (places_[order[i]] == places_[order[i - 1]]) unite(order[i - 1], order[i]);
    }
    low_ = glm::dvec2(std::numeric_limits<double>::infinity());
    glm::dvec2 high = -low_;
    for (const glm::dvec2& p : places_) low_ = glm::min(low_, p), high = glm::max(high, p);
    extent_ = places_.empty() ? 0.0 : std::max(high.x - low_.x, high.y - low_.y);
  }

  /// Unites ends that lie within `tolerance` of each other.
  void unite_within(double tolerance) {
    constexpr double kMost = 1e-6;
    const std::vector<double> half(places_.size(), std::min(tolerance, kMost * extent_) / 2);
    unite_near(half, std::vector<bool>(places_.size(), true));
  }

  /// Unites points where an odd number of lines ends with points whose reach overlaps theirs.
  void unite_odd() {
    constexpr double kMost = 1e-3;
    std::vector<bool> odd(places_.size(), false);
    for (Index i = 0; i < places_.size(); ++i) {
      // A line whose two ends are one point does not count.
      if (find(i) != find(i ^ 1u)) odd[find(i)] = !odd[find(i)];
    }
    for (Index i = 0; i < places_.size(); ++i) odd[i] = odd[find(i)];
    std::vector<double> reaches = reaches_;
    for (double& reach : reaches) reach = std::min(reach, kMost * extent_ / 2);
    unite_near(reaches, odd);
  }

  Index find(Index i) {
    while (groups_[i] != i) i = groups_[i] = groups_[groups_[i]];
    return i;
  }
  const glm::dvec2& place(Index i) const { return places_[i]; }

 private:
  /// Whether end `a` represents the group of both rather than `b`: the end with the smaller reach
  /// does.
  bool before(Index a, Index b) const {
    const glm::dvec2 &p = places_[a], &q = places_[b];
    if (reaches_[a] != reaches_[b]) return reaches_[a] < reaches_[b];
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : a < b;
  }
  void unite(Index a, Index b) {
    a = find(a), b = find(b);
    if (before(b, a)) std::swap(a, b);
    groups_[b] = a;
  }

  /// Unites each end that is `wanted` with every end at a distance of at most the sum of their
  /// reaches.
  void unite_near(const std::vector<double>& reach, const std::vector<bool>& wanted) {
    double size = 0;
    for (const double r : reach) size = std::max(size, 2 * r);
    if (!(size > 0)) return;
    using Cell = std::pair<std::int64_t, std::int64_t>;
    struct CellHash {
      std::size_t operator()(const Cell& cell) const {
        const auto x = static_cast<std::uint64_t>(cell.first),
                   y = static_cast<std::uint64_t>(cell.second);
        const std::uint64_t h = x * 0x9e3779b97f4a7c15u ^ (y + 0x165667b1u) * 0xc2b2ae3d27d4eb4fu;
        return static_cast<std::size_t>(h ^ (h >> 31));
      }
    };
    const auto cell_of = [&](const glm::dvec2& p) {
      constexpr double kMost = 4e18;
      const glm::dvec2 at = glm::min(glm::floor((p - low_) / size), glm::dvec2(kMost));
      return Cell(static_cast<std::int64_t>(at.x), static_cast<std::int64_t>(at.y));
    };
    // One end represents all ends in the same place: the one with the largest reach.
    std::unordered_map<Cell, std::vector<Index>, CellHash> cells;
    std::vector<Index> order(places_.size());
    std::iota(order.begin(), order.end(), Index{0});
    const auto less = [&](Index a, Index b) {
      const glm::dvec2 &p = places_[a], &q = places_[b];
      if (p.x != q.x) return p.x < q.x;
      if (p.y != q.y) return p.y < q.y;
      return reach[a] != reach[b] ? reach[a] > reach[b] : a < b;
    };
    std::sort(order.begin(), order.end(), less);
    order.erase(std::unique(order.begin(), order.end(),
                            [&](Index a, Index b) { return places_[a] == places_[b]; }),
                order.end());
    for (const Index i : order) cells[cell_of(places_[i])].push_back(i);
    for (const Index i : order) {
      if (stop_.stop_requested()) return;
      if (!wanted[i]) continue;
      const Cell middle = cell_of(places_[i]);
      for (std::int64_t x = middle.first - 1; x <= middle.first + 1; ++x) {
        for (std::int64_t y = middle.second - 1; y <= middle.second + 1; ++y) {
          const auto found = cells.find({x, y});
          if (found == cells.end()) continue;
          for (const Index j : found->second) {
            if (glm::distance(places_[i], places_[j]) <= reach[i] + reach[j]) unite(i, j);
          }
        }
      }
    }
  }

  const std::stop_token& stop_;
  std::vector<glm::dvec2> places_;  ///< the ends of line i are 2 i and 2 i + 1
  std::vector<double> reaches_;
  std::vector<Index> groups_;  ///< union-find parents; a group is represented by its root
  glm::dvec2 low_{0};
  double extent_ = 0;
};

/// Walks along lines between numbered points. Each line is used once.
class Walk {
 public:
  struct Line {
    Index first = 0, second = 0, number = 0;
  };
  Walk(std::vector<Line> lines, std::size_t points)
      : lines_(std::move(lines)),
        at_(points),
        left_(points),
        looked_(points, 0),
        used_(lines_.size(), false) {
    for (Index i = 0; i < lines_.size(); ++i) {
      at_[lines_[i].first].push_back(i);
      at_[lines_[i].second].push_back(i);
    }
    for (std::size_t p = 0; p < points; ++p) left_[p] = static_cast<Index>(at_[p].size());
    for (Index p = 0; p < points; ++p) note(p);
  }

  /// Calls visit(points, number of the first line) for each path.
  template <class Visit>
  void run(const Visit& visit) {
    Index next = 0;
    while (true) {
      if (!ends_.empty()) {
        const Line& line = lines_[*ends_.begin()];
        follow(*ends_.begin(), left_[line.first] == 1 ? line.first : line.second, visit);
        continue;
      }
      while (next < lines_.size() && used_[next]) ++next;
      if (next == lines_.size()) break;
      follow(next, lines_[next].first, visit);
    }
  }

 private:
  void note(Index p) {
    if (left_[p] != 1) return;
    for (Index& i = looked_[p]; i < at_[p].size(); ++i) {
      if (!used_[at_[p][i]]) {
        ends_.insert(at_[p][i]);
        return;
      }
    }
  }

  template <class Visit>
  void follow(Index line, Index from, const Visit& visit) {
    const Index number = lines_[line].number;
    std::vector<Index> path{from};
    while (true) {
      const Index to = lines_[line].first == from ? lines_[line].second : lines_[line].first;
      used_[line] = true;
      ends_.erase(line);
      --left_[from], --left_[to];
      note(from);
      from = to;
      path.push_back(from);
      Index& i = looked_[from];
      while (i < at_[from].size() && used_[at_[from][i]]) ++i;
      if (i == at_[from].size()) break;
      line = at_[from][i];
    }
    visit(path, number);
  }

  std::vector<Line> lines_;
  std::vector<std::vector<Index>> at_;  ///< lines at each point, in the order of addition
  std::vector<Index> left_;             ///< number of unused lines at each point
  std::vector<Index> looked_;           ///< all lines before this index of at_ are used
  std::vector<bool> used_;
  std::set<Index> ends_;  ///< unused lines that are the only one at one of their points
};

}  // namespace

void LineJoiner::add(const glm::dvec2& from, const glm::dvec2& to, double reach,
                     std::uint32_t tag) {
  if (from != to) lines_.push_back({{from, to}, reach, tag});
}

JoinedLines LineJoiner::join(double tolerance, const std::stop_token& stop) const {
  Points points(stop);
  for (const Line& line : lines_) {
    for (const glm::dvec2& end : line.ends) points.add(end, line.reach);
  }
  points.group_equal();
  points.unite_within(tolerance);
  if (stop.stop_requested()) return {};
  points.unite_odd();
  if (stop.stop_requested()) return {};
  std::vector<Walk::Line> lines;
  std::vector<Index> numbers(2 * lines_.size(), 0);  // by root of a group, from 1; 0: no number yet
  std::vector<glm::dvec2> places;
  const auto number = [&](Index root) {
    if (numbers[root] == 0) {
      places.push_back(points.place(root));
      numbers[root] = static_cast<Index>(places.size());
    }
    return numbers[root] - 1;
  };
  for (Index i = 0; i < lines_.size(); ++i) {
    const Index a = points.find(2 * i), b = points.find(2 * i + 1);
    if (a != b) lines.push_back({number(a), number(b), i});
  }
  JoinedLines joined;
  Walk(std::move(lines), places.size()).run([&](const std::vector<Index>& path, Index first) {
    const bool closed = path.front() == path.back();
    if (!closed) {
      joined.open.push_back(
          {places[path.front()], places[path.back()], lines_[first].tag, path.size() == 2});
    }
    if (path.size() < (closed ? 4u : 3u)) return;
    auto& contour = joined.paths.emplace_back();
    for (std::size_t i = 0; i + (closed ? 1 : 0) < path.size(); ++i) {
      contour.push_back(places[path[i]]);
    }
  });
  return joined;
}

}  // namespace strata::csg
