#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "core/buckets.h"
#include "csg/arrangement/cut_lines.h"
#include "exact/directions.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;
using exact::Plane;

constexpr std::size_t kFewCuts = 24;

// A cut or a contact of one triangle, seen from above it.
struct Item {
  std::uint32_t line, from, to;  // a contact: no line, from == to
  double low[2], high[2];        // the box, in steps
  LatticeBox box;                // the same along all axes
  Plane wall;                    // contains the line and not the triangle

  bool touches(const Item& other) const {
    return low[0] <= other.high[0] && other.low[0] <= high[0] && low[1] <= other.high[1] &&
           other.low[1] <= high[1];
  }
};

constexpr std::uint32_t kNoLine = 0xffffffffu;

class Crosser {
 public:
  Crosser(const ArrangementInput& input, const BoundaryPoints& points, const CutLines& lines,
          CutLinesPart& out)
      : input_(input), points_(points), lines_(lines), out_(out) {}

  void run(std::uint32_t triangle, std::span<const CutLines::Cut> cuts,
           std::span<const CutLines::Contact> contacts);

 private:
  Item item(std::uint32_t line, std::uint32_t from, std::uint32_t to) const;
  Plane wall_of(std::uint32_t line) const;
  void compare(const Item& a, const Item& b);
  void compare_aligned(const Item& a, const Item& b);
  void put(const Item& item, std::uint32_t point) {
    if (item.line == kNoLine || point == item.from || point == item.to) return;
    out_.line_points.push_back({item.line, point});
  }
  bool is_edge(std::uint32_t line) const { return line < input_.edges.size(); }
  std::uint32_t cross(const Item& a, const Item& b);
  void compare_in_cells();

  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  const CutLines& lines_;
  CutLinesPart& out_;
  std::uint32_t triangle_ = 0;
  int u_ = 0, v_ = 1;
  std::vector<Item> items_;
  std::vector<std::uint32_t> first_, next_, cell_items_;
  std::vector<std::uint32_t> compared_;  // of each item, the last one that it was compared with
};

Plane Crosser::wall_of(std::uint32_t line) const {
  if (!is_edge(line)) {
    const CrossingLine& crossing = lines_.crossings[line - input_.edges.size()];
    return input_.plane_of(crossing.first == triangle_ ? crossing.second : crossing.first);
  }
  const LatticePoint &p = input_.vertices[input_.edge_from(line)],
                     &q = input_.vertices[input_.edge_to(line)];
  LatticePoint up(1);
  up[u_] = up[v_] = 0;
  return exact::plane_through(p, q, p + up);
}

Item Crosser::item(std::uint32_t line, std::uint32_t from, std::uint32_t to) const {
  const exact::FilePoint a = points_.rounded(from), b = points_.rounded(to);
  Item result{line, from, to, {}, {}, box_around(a, b), {}};
  const int axes[2] = {u_, v_};
  for (int k = 0; k < 2; ++k) {
    const auto [low, high] = std::minmax(a[axes[k]], b[axes[k]]);
    result.low[k] = static_cast<double>(low) * 0x1p-24 - 1;  // rounding moves by less
    result.high[k] = static_cast<double>(high) * 0x1p-24 + 1;
  }
  if (line != kNoLine) result.wall = wall_of(line);
  return result;
}

// The point where two lines of the triangle cross, by the shortest recipe.
std::uint32_t Crosser::cross(const Item& a, const Item& b) {
  using Kind = BoundaryPoints::Kind;
  const auto other = [&](const Item& item) {
    const CrossingLine& crossing = lines_.crossings[item.line - input_.edges.size()];
    return crossing.first == triangle_ ? crossing.second : crossing.first;
  };
  const auto ends = [&](const Item& item) {
    return std::pair<std::uint32_t, std::uint32_t>(
        std::minmax(input_.edge_from(item.line), input_.edge_to(item.line)));
  };
  if (is_edge(a.line) && is_edge(b.line)) {
    const auto [p, q] = ends(a);
    const auto [r, s] = ends(b);
    return out_.add_point(points_, BoundaryPoints::Recipe::of_edges({p, q}, {r, s}));
  }
  if (is_edge(a.line) || is_edge(b.line)) {
    const auto [p, q] = ends(is_edge(a.line) ? a : b);
    return out_.add_point(points_, {Kind::kEdgePlane, {p, q, other(is_edge(a.line) ? b : a), 0}});
  }
  std::array<std::uint32_t, 3> planes{triangle_, other(a), other(b)};
  std::ranges::sort(planes);
  return out_.add_point(points_, {Kind::kThreePlanes, {planes[0], planes[1], planes[2], 0}});
}

void Crosser::compare(const Item& a, const Item& b) {
  if (a.line == b.line || !a.touches(b)) return;
  if (!input_.zone.touches({glm::max(a.box.low, b.box.low), glm::min(a.box.high, b.box.high)})) {
    return;
  }
  const auto side = [&](std::uint32_t point, const Item& of) {
    return point == of.from || point == of.to ? 0 : side_of(points_, point, of.wall);
  };
  if (a.line == kNoLine || b.line == kNoLine) {
    const Item &contact = a.line == kNoLine ? a : b, &cut = a.line == kNoLine ? b : a;
    if (side(contact.from, cut) == 0) compare_aligned(contact, cut);
    return;
  }
  const int a_from = side(a.from, b), a_to = side(a.to, b);
  if (a_from * a_to > 0) return;
  if (a_from == 0 && a_to == 0) return compare_aligned(a, b);
  const int b_from = side(b.from, a), b_to = side(b.to, a);
  if (b_from * b_to > 0) return;
  if (a_from == 0) return put(b, a.from);
  if (a_to == 0) return put(b, a.to);
  if (b_from == 0) return put(a, b.from);
  if (b_to == 0) return put(a, b.to);
  const std::uint32_t point = cross(a, b);
  put(a, point);
  put(b, point);
}

// Both lie on one line; a may be a contact.
void Crosser::compare_aligned(const Item& a, const Item& b) {
  const int axis = axis_of(input_, lines_, b.line).axis;
  const auto within = [&](std::uint32_t point, const Item& of) {
    const int x = order_along(points_, point, of.from, axis),
              y = order_along(points_, point, of.to, axis);
    return x * y < 0;
  };
  for (const std::uint32_t point : {a.from, a.to}) {
    if (within(point, b)) put(b, point);
  }
  if (a.line == kNoLine) return;
  for (const std::uint32_t point : {b.from, b.to}) {
    if (within(point, a)) put(a, point);
  }
}

// Items are put into the cells of a square grid that they run through, with a margin of a step.
void Crosser::compare_in_cells() {
  double low[2] = {items_[0].low[0], items_[0].low[1]},
         high[2] = {items_[0].high[0], items_[0].high[1]};
  for (const Item& item : items_) {
    for (int k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], item.low[k]);
      high[k] = std::max(high[k], item.high[k]);
    }
  }
  const int across =
      std::clamp(static_cast<int>(std::sqrt(static_cast<double>(items_.size()))), 1, 2048);
  const double scale[2] = {across / (high[0] - low[0]), across / (high[1] - low[1])};
  const auto cell = [&](double x, int k) {
    return std::clamp(static_cast<int>((x - low[k]) * scale[k]), 0, across - 1);
  };
  const auto for_cells = [&](const Item& item, const auto& work) {
    const int first_row = cell(item.low[1], 1), last_row = cell(item.high[1], 1);
    const exact::FilePoint a = points_.rounded(item.from), b = points_.rounded(item.to);
    const double ax = static_cast<double>(a[u_]) * 0x1p-24,
                 ay = static_cast<double>(a[v_]) * 0x1p-24,
                 bx = static_cast<double>(b[u_]) * 0x1p-24,
                 by = static_cast<double>(b[v_]) * 0x1p-24;
    const bool steep = std::abs(by - ay) > 1;
    for (int row = first_row; row <= last_row; ++row) {
      double left = item.low[0], right = item.high[0];
      if (steep && first_row != last_row) {
        const double y0 = low[1] + row / scale[1] - 1, y1 = low[1] + (row + 1) / scale[1] + 1;
        const double x0 = ax + (bx - ax) * std::clamp((y0 - ay) / (by - ay), 0.0, 1.0),
                     x1 = ax + (bx - ax) * std::clamp((y1 - ay) / (by - ay), 0.0, 1.0);
        const double margin = 2 + std::abs((bx - ax) / (by - ay));
        left = std::max(left, std::min(x0, x1) - margin);
        right = std::min(right, std::max(x0, x1) + margin);
      }
      for (int column = cell(left, 0); column <= cell(right, 0); ++column) {
        work(static_cast<std::size_t>(row) * static_cast<std::size_t>(across) +
             static_cast<std::size_t>(column));
      }
    }
  };
  first_.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(across) + 1, 0);
  for (const Item& item : items_) for_cells(item, [&](std::size_t c) { ++first_[c + 1]; });
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  next_.assign(first_.begin(), first_.end() - 1);
  cell_items_.resize(first_.back());
  for (std::uint32_t i = 0; i < items_.size(); ++i) {
    for_cells(items_[i], [&](std::size_t c) { cell_items_[next_[c]++] = i; });
  }
  // Each pair once, however many cells both run through. Items of a cell are in order.
  compared_.assign(items_.size(), kNoLine);
  for (std::uint32_t i = 0; i < items_.size(); ++i) {
    for_cells(items_[i], [&](std::size_t c) {
      for (std::uint32_t at = first_[c]; cell_items_[at] < i; ++at) {
        const std::uint32_t j = cell_items_[at];
        if (std::exchange(compared_[j], i) != i) compare(items_[j], items_[i]);
      }
    });
  }
}

void Crosser::run(std::uint32_t triangle, std::span<const CutLines::Cut> cuts,
                  std::span<const CutLines::Contact> contacts) {
  triangle_ = triangle;
  const exact::PlaneView view(input_.plane_of(triangle));
  u_ = view.u();
  v_ = view.v();
  items_.clear();
  for (const CutLines::Cut& cut : cuts) {
    items_.push_back(item(cut.line, cut.from, cut.to));
    if (!input_.zone.touches(items_.back().box)) items_.pop_back();
  }
  for (const CutLines::Contact& contact : contacts) {
    items_.push_back(item(kNoLine, contact.point, contact.point));
  }
  if (items_.size() > kFewCuts) return compare_in_cells();
  for (std::size_t j = 1; j < items_.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) compare(items_[i], items_[j]);
  }
}

}  // namespace

LineAxis axis_of(const exact::Cross& direction) {
  const auto size = [&](int k) {
    const exact::Int128 x = direction[static_cast<std::size_t>(k)];
    return x < 0 ? -x : x;
  };
  int axis = size(1) > size(0) ? 1 : 0;
  if (size(2) > size(axis)) axis = 2;
  return {axis, direction[static_cast<std::size_t>(axis)] > 0};
}

LineAxis axis_of(const ArrangementInput& input, const CutLines& lines, std::uint32_t line) {
  if (line >= input.edges.size()) return lines.crossings[line - input.edges.size()].axis;
  const LatticePoint along =
      input.vertices[input.edge_to(line)] - input.vertices[input.edge_from(line)];
  const LatticePoint size = glm::abs(along);
  int axis = size.y > size.x ? 1 : 0;
  if (size.z > size[axis]) axis = 2;
  return {axis, along[axis] > 0};
}

exact::Cross direction_of(const ArrangementInput& input, const CutLines& lines,
                          std::uint32_t line) {
  if (line < input.edges.size()) {
    const LatticePoint along =
        input.vertices[input.edge_to(line)] - input.vertices[input.edge_from(line)];
    return {along.x, along.y, along.z};
  }
  const CrossingLine& crossing = lines.crossings[line - input.edges.size()];
  return exact::cross(input.plane_of(crossing.first).normal,
                      input.plane_of(crossing.second).normal);
}

namespace {

// By triangles; those of one triangle by lines.
void sort_cuts(std::vector<CutLines::Cut>& cuts, std::size_t triangles) {
  const detail::Buckets buckets =
      detail::bucket(cuts.size(), triangles, [&](std::size_t i) { return cuts[i].triangle; });
  std::vector<CutLines::Cut> sorted;
  sorted.reserve(cuts.size());
  for (const std::uint32_t i : buckets.items) sorted.push_back(cuts[i]);
  for (std::size_t t = 0; t < triangles; ++t) {
    if (buckets.first[t + 1] - buckets.first[t] < 2) continue;
    std::sort(sorted.begin() + buckets.first[t], sorted.begin() + buckets.first[t + 1],
              [](const CutLines::Cut& x, const CutLines::Cut& y) {
                return std::tie(x.line, x.from, x.to) < std::tie(y.line, y.from, y.to);
              });
  }
  cuts = std::move(sorted);
}

}  // namespace

Result<void> cross_lines(const ArrangementInput& input, PointTable& points, CutLines& lines,
                         const Execution& execution) {
  sort_cuts(lines.cuts, input.triangles.size());
  std::ranges::sort(lines.contacts, [](const CutLines::Contact& x, const CutLines::Contact& y) {
    return std::tie(x.triangle, x.point) < std::tie(y.triangle, y.point);
  });
  struct Task {
    std::span<const CutLines::Cut> cuts;
    std::span<const CutLines::Contact> contacts;
  };
  std::vector<Task> tasks;
  auto contact = lines.contacts.begin();
  for (auto cut = lines.cuts.begin(); cut != lines.cuts.end();) {
    const std::uint32_t triangle = cut->triangle;
    const auto end = std::find_if(cut, lines.cuts.end(), [&](const CutLines::Cut& other) {
      return other.triangle != triangle;
    });
    while (contact != lines.contacts.end() && contact->triangle < triangle) ++contact;
    auto last = contact;
    while (last != lines.contacts.end() && last->triangle == triangle) ++last;
    if (end - cut + (last - contact) > 1) tasks.push_back({{cut, end}, {contact, last}});
    cut = end;
    contact = last;
  }
  // Blocks of about as many lines: some triangles are cut by thousands.
  constexpr std::size_t kBlock = 2048;
  std::vector<std::size_t> first{0};
  std::size_t size = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    size += tasks[i].cuts.size();
    if (size < kBlock && i + 1 < tasks.size()) continue;
    first.push_back(i + 1);
    size = 0;
  }
  std::vector<CutLinesPart> parts(first.size() - 1);
  parallel_for(execution, parts.size(), [&](std::size_t part, int) {
    Crosser crosser(input, points.points(), lines, parts[part]);
    for (std::size_t i = first[part]; i < first[part + 1]; ++i) {
      crosser.run(tasks[i].cuts.front().triangle, tasks[i].cuts, tasks[i].contacts);
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  join_parts(input, std::move(parts), points, lines);
  return {};
}

namespace {

// Rounding keeps orders, so exact ones are needed only where rounded points are equal.
void sort_points(const BoundaryPoints& points, const LineAxis& along, std::span<std::uint32_t> line,
                 std::vector<std::pair<std::int64_t, std::uint32_t>>& keys) {
  const auto [axis, rising] = along;
  keys.clear();
  for (const std::uint32_t point : line) {
    const std::int64_t x = points.rounded(point)[axis];
    keys.emplace_back(rising ? x : -x, point);
  }
  std::ranges::sort(keys);
  for (std::size_t i = 0; i < keys.size(); ++i) line[i] = keys[i].second;
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t j = i + 1;
    bool differ = false;
    for (; j < keys.size() && keys[j].first == keys[i].first; ++j) {
      differ = differ || keys[j].second != keys[i].second;
    }
    if (differ) {
      const int up = rising ? -1 : 1;
      std::sort(line.begin() + static_cast<std::ptrdiff_t>(i),
                line.begin() + static_cast<std::ptrdiff_t>(j),
                [&points, axis = along.axis, up](std::uint32_t x, std::uint32_t y) {
                  return x != y && order_along(points, x, y, axis) == up;
                });
    }
    i = j;
  }
}

}  // namespace

SortedLines sort_lines(const ArrangementInput& input, const BoundaryPoints& points,
                       const CutLines& lines) {
  SortedLines result;
  const std::size_t edges = input.edges.size(), count = edges + lines.crossings.size();
  result.first.assign(count + 1, 0);
  const auto has_list = [&](std::uint32_t line) { return line >= edges || lines.touched[line]; };
  for (std::uint32_t line = 0; line < count; ++line)
    result.first[line + 1] = has_list(line) ? 2 : 0;
  for (const auto& [line, point] : lines.line_points) ++result.first[line + 1];
  for (std::size_t line = 0; line < count; ++line) result.first[line + 1] += result.first[line];
  std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1),
      all(result.first.back());
  const auto ends = [&](std::uint32_t line) {
    if (line < edges) return std::pair(input.edge_from(line), input.edge_to(line));
    const CrossingLine& crossing = lines.crossings[line - edges];
    return std::pair(crossing.from, crossing.to);
  };
  for (std::uint32_t line = 0; line < count; ++line) {
    if (!has_list(line)) continue;
    const auto [from, to] = ends(line);
    all[next[line]++] = from;
    all[next[line]++] = to;
  }
  for (const auto& [line, point] : lines.line_points) all[next[line]++] = point;
  // Sorted, each point once.
  std::vector<std::pair<std::int64_t, std::uint32_t>> keys;
  std::size_t kept = 0;
  for (std::uint32_t line = 0; line < count; ++line) {
    const auto begin = all.begin() + result.first[line], end = all.begin() + next[line];
    result.first[line] = static_cast<std::uint32_t>(kept);
    if (begin == end) continue;
    if (end - begin > 2) {
      sort_points(points, axis_of(input, lines, line), {begin, end}, keys);
    }
    for (auto at = begin; at != end; ++at) {
      if (at == begin || *at != *(at - 1)) result.points.push_back(*at);
    }
    kept = result.points.size();
  }
  result.first[count] = static_cast<std::uint32_t>(kept);
  return result;
}

}  // namespace strata::csg
