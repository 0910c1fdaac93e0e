#include "mesh/polygons/face_sweep.h"

#include <algorithm>

// This work is based on: S. Hertel, K. Mehlhorn, "Fast triangulation of simple polygons", 1983: a
// sweep line keeps, for each interval in which it is inside, the points that still see what is to
// come, and a new point is joined to those that it sees. And on: M. I. Shamos, D. Hoey, "Geometric
// intersection problems", 1976: edges that become neighbours on the sweep line are compared, so a
// region whose edges cross is found.
//
// We differ: the triangulation is made Delaunay as it grows, which takes fewer flips than
// afterwards, since long triangles never pile up.

namespace strata {

int FaceSweep::turn(Index a, Index b, Index c) const {
  if (view_.points.empty()) return exact::orient2d(points_[a], points_[b], points_[c]);
  return exact::orient2d(view_.points[a], view_.points[b], view_.points[c], view_.u, view_.v);
}

// Whether two edges that meet the sweep line as neighbours stay apart until one ends.
bool FaceSweep::apart(Index below, Index above) const {
  const Index below_end = right_end(below), above_end = right_end(above);
  if (below_end == above_end) return true;
  return below_end < above_end ? side(above, below_end) < 0 : side(below, above_end) > 0;
}

bool FaceSweep::apart_from_neighbours(Interval interval) const {
  const Interval previous = order_.previous(interval), next = order_.next(interval);
  const Bounds& bounds = bounds_[interval];
  return apart(bounds.lower, bounds.upper) &&
         (previous == kNone || apart(bounds_[previous].upper, bounds.lower)) &&
         (next == kNone || apart(bounds.upper, bounds_[next].lower));
}

void FaceSweep::set_lower(Interval interval, Index edge) {
  bounds_[interval].lower = edge;
  interval_of_[edge] = interval;
}
void FaceSweep::set_upper(Interval interval, Index edge) {
  bounds_[interval].upper = edge;
  interval_of_[edge] = interval;
}

FaceSweep::Index FaceSweep::add_node(Index point) {
  front_.push_back({point, kNone, kNone});
  return mesh_->add_link();
}

// Makes the triangle of a node of the front and its two neighbours, if these see each other. The
// point that is added sees its edge `seen`.
bool FaceSweep::cut_off(Index node, DelaunayMesh::Side seen) {
  FrontNode& middle = front_[node];
  FrontNode &low = front_[middle.previous], &high = front_[middle.next];
  if (turn(low.point, high.point, middle.point) <= 0) return false;
  const DelaunayMesh::Side side = 3 * mesh_->add_triangle(low.point, high.point, middle.point);
  mesh_->join(side + 1, mesh_->beneath(node));
  mesh_->join(side + 2, mesh_->beneath(middle.previous));
  mesh_->join(side, DelaunayMesh::link(middle.previous));
  mesh_->suspect(side + seen);
  low.next = middle.next;
  high.previous = middle.previous;
  return true;
}

void FaceSweep::advance_up(Index node) {
  while (front_[front_[node].next].next != kNone && cut_off(front_[node].next, 1)) {
  }
}
void FaceSweep::advance_down(Index node) {
  while (front_[front_[node].previous].previous != kNone && cut_off(front_[node].previous, 2)) {
  }
}

// The lower edge of an interval ends at a point.
FaceSweep::Index FaceSweep::extend_low(Interval interval, Index point) {
  const Index node = add_node(point);
  Bounds& bounds = bounds_[interval];
  front_[node].next = bounds.low;
  front_[bounds.low].previous = node;
  mesh_->join(DelaunayMesh::link(node), DelaunayMesh::outline(bounds.lower));
  bounds.low = bounds.latest = node;
  advance_up(node);
  return node;
}
FaceSweep::Index FaceSweep::extend_high(Interval interval, Index point) {
  const Index node = add_node(point);
  Bounds& bounds = bounds_[interval];
  front_[node].previous = bounds.high;
  front_[bounds.high].next = node;
  mesh_->join(DelaunayMesh::link(bounds.high), DelaunayMesh::outline(bounds.upper));
  bounds.high = bounds.latest = node;
  advance_down(node);
  return node;
}

// The point is joined to the latest one of the front, which becomes two nodes. Where edges start at
// the point, the interval is divided there.
void FaceSweep::join_latest(Index point, Interval interval, bool split) {
  const Index node = add_node(point), upper_node = split ? add_node(point) : node;
  Bounds& bounds = bounds_[interval];
  const Index latest = bounds.latest, copy = add_node(front_[latest].point);
  Index high = bounds.high;
  if (latest == high) {
    high = copy;
  } else {
    front_[copy].next = front_[latest].next;
    front_[front_[copy].next].previous = copy;
    mesh_->join(DelaunayMesh::link(copy), mesh_->beneath(latest));
  }
  front_[latest].next = node;
  front_[node].previous = latest;
  front_[upper_node].next = copy;
  front_[copy].previous = upper_node;
  mesh_->join(DelaunayMesh::link(latest), DelaunayMesh::link(upper_node));
  bounds.latest = node;
  bounds.high = split ? node : high;
  if (split) {
    const Index upper = bounds.upper;
    around_.above = order_.insert_after(interval);
    bounds_.push_back({kNone, kNone, upper_node, high, upper_node});
    set_upper(around_.above, upper);
  }
  advance_down(node);
  advance_up(upper_node);
}

// Two intervals whose fronts end at the same point become one.
void FaceSweep::merge(Interval below, Interval above) {
  Bounds& bounds = bounds_[below];
  const Bounds& other = bounds_[above];
  const Index node = bounds.high, second = front_[other.low].next;
  front_[node].next = second;
  front_[second].previous = node;
  mesh_->join(DelaunayMesh::link(node), mesh_->beneath(other.low));
  bounds.high = other.high;
  bounds.latest = node;
  set_upper(below, other.upper);
  order_.erase(above);
}

// The pairs of edges left of a point are the ends of intervals. Each point of their fronts sees it.
bool FaceSweep::close_between(Index point, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; i += 2) {
    const Index lower = around_.left[i];
    const Interval interval = interval_of_[lower];
    if (i + 1 >= last || !is_lower(lower) || is_lower(around_.left[i + 1]) ||
        interval_of_[around_.left[i + 1]] != interval) {
      return false;
    }
    const Index node = extend_low(interval, point);
    const DelaunayMesh::Side closing = mesh_->beneath(node);
    if (front_[node].next != bounds_[interval].high || !DelaunayMesh::is_half_edge(closing)) {
      return false;
    }
    mesh_->join(closing, DelaunayMesh::outline(around_.left[i + 1]));
    order_.erase(interval);
  }
  return true;
}

bool FaceSweep::open_between(Index point, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; i += 2) {
    if (i + 1 >= last || !is_lower(around_.right[i]) || is_lower(around_.right[i + 1])) {
      return false;
    }
    around_.previous = order_.insert_after(around_.previous);
    const Index node = add_node(point);
    bounds_.push_back({kNone, kNone, node, node, node});
    set_lower(around_.previous, around_.right[i]);
    set_upper(around_.previous, around_.right[i + 1]);
    if (!apart_from_neighbours(around_.previous)) return false;
  }
  return true;
}

// Finds what a point without edges to its left lies in.
bool FaceSweep::locate(Index point) {
  bool on_edge = false;
  const Interval interval = order_.last_where([&](Interval candidate) {
    const int above = side(bounds_[candidate].lower, point);
    on_edge = on_edge || above == 0;
    return above > 0;
  });
  const int below = interval == kNone ? 1 : side(bounds_[interval].upper, point);
  around_.previous = interval;
  if (below < 0) around_.below = around_.above = interval;
  return !on_edge && below != 0;
}

// Ends the edges left of a point.
bool FaceSweep::visit_left(Index point) {
  const std::vector<Index>& left = around_.left;
  around_.below = around_.above = kNone;
  if (left.empty()) {
    if (!locate(point)) return false;
    if (around_.below != kNone) join_latest(point, around_.below, !around_.right.empty());
    return true;
  }
  if (!is_lower(left.front())) {
    around_.below = around_.previous = interval_of_[left.front()];
    extend_high(around_.below, point);
  } else {
    around_.previous = order_.previous(interval_of_[left.front()]);
  }
  if (is_lower(left.back())) {
    around_.above = interval_of_[left.back()];
    extend_low(around_.above, point);
  }
  return close_between(point, around_.below != kNone ? 1 : 0,
                       left.size() - (around_.above != kNone ? 1 : 0));
}

// Starts the edges right of a point.
bool FaceSweep::visit_right(Index point) {
  const std::vector<Index>& right = around_.right;
  const Interval below = around_.below, above = around_.above;
  if (right.empty()) {
    if ((below == kNone) != (above == kNone)) return false;
    if (below != above) merge(below, above);
    if (below != kNone) return apart_from_neighbours(below);
    const Interval next =
        around_.previous == kNone ? order_.first() : order_.next(around_.previous);
    return around_.previous == kNone || next == kNone ||
           apart(bounds_[around_.previous].upper, bounds_[next].lower);
  }
  if (is_lower(right.front()) != (below == kNone) || is_lower(right.back()) != (above != kNone)) {
    return false;
  }
  if (below != kNone) set_upper(below, right.front());
  if (above != kNone) set_lower(above, right.back());
  return (below == kNone || apart_from_neighbours(below)) &&
         (above == kNone || apart_from_neighbours(above)) &&
         open_between(point, below != kNone ? 1 : 0, right.size() - (above != kNone ? 1 : 0));
}

// Collects the edges at a point, sorted.
void FaceSweep::sort_around(Index point) {
  around_.left.clear();
  around_.right.clear();
  for (Index i = first_[point]; i < first_[point + 1]; ++i) {
    const bool starts = left_end(at_[i]) == point;
    (starts ? around_.right : around_.left).push_back(at_[i]);
  }
  // Where two edges coincide, they are the sides of a slit, and the region is below the first one.
  const auto slit = [this](Index a, Index b) { return !is_lower(a) && is_lower(b); };
  if (around_.left.size() > 1) {
    std::sort(around_.left.begin(), around_.left.end(), [&](Index a, Index b) {
      const int order = turn(point, left_end(a), left_end(b));
      return order != 0 ? order < 0 : slit(a, b);
    });
  }
  if (around_.right.size() > 1) {
    std::sort(around_.right.begin(), around_.right.end(), [&](Index a, Index b) {
      const int order = turn(point, right_end(a), right_end(b));
      return order != 0 ? order > 0 : slit(a, b);
    });
  }
}

void FaceSweep::index_edges(std::size_t point_count) {
  first_.assign(point_count + 1, 0);
  for (const FlatEdge& edge : edges_) ++first_[edge.from], ++first_[edge.to];
  Index sum = 0;
  for (Index& first : first_) first = sum += first;
  at_.resize(2 * edges_.size());
  for (Index edge = 0; edge < edges_.size(); ++edge) {
    at_[--first_[edges_[edge].from]] = edge;
    at_[--first_[edges_[edge].to]] = edge;
  }
}

bool FaceSweep::sweep(std::size_t point_count, std::span<const FlatEdge> edges) {
  edges_ = edges;
  index_edges(point_count);
  interval_of_.assign(edges.size(), kNone);
  order_.clear();
  bounds_.clear();
  front_.clear();
  const bool legalize = view_.points.empty();
  for (Index point = 0; point < point_count; ++point) {
    sort_around(point);
    if (!visit_left(point) || !visit_right(point)) return false;
    if (legalize) mesh_->legalize();
  }
  return order_.first() == kNone;
}

bool FaceSweep::cut(std::span<const exact::FlatPoint> points, std::span<const FlatEdge> edges,
                    DelaunayMesh& mesh) {
  points_ = points;
  view_ = {};
  mesh_ = &mesh;
  mesh.begin(points);
  return sweep(points.size(), edges);
}

bool FaceSweep::cut(const ExactView& view, std::span<const FlatEdge> edges, DelaunayMesh& mesh) {
  view_ = view;
  mesh_ = &mesh;
  return sweep(view.points.size(), edges);
}

}  // namespace strata
