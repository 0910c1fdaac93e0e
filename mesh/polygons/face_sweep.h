#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "mesh/polygons/delaunay_mesh.h"
#include "mesh/polygons/interval_order.h"

namespace strata {

/// A directed edge of a region in the plane, with the region on its left.
struct FlatEdge {
  std::uint32_t from, to;  ///< points
};

/// Triangulates a region in the plane in O(n log n): polygons with holes, which may touch in
/// points. Points without an edge become corners where they lie inside of the region. An edge
/// that is there in both directions is a slit: the region is on both of its sides.
/// One object serves one thread; it keeps its memory between calls.
class FaceSweep {
 public:
  /// Exact points in a projection, for regions that rounding has made cross themselves.
  struct ExactView {
    std::span<const exact::RationalPoint> points;
    int u = 0, v = 1;
  };

  /// Puts the constrained Delaunay triangulation into `mesh`.
  /// @param points  each once, in the order in which a straight line that sweeps to the right meets
  ///                them, and from below on that line: (x, y) does. One that is not in line with
  ///                rows of holes is faster: it meets them one at a time.
  /// @return false when edges cross or touch each other, or do not bound a region
  bool cut(std::span<const exact::FlatPoint> points, std::span<const FlatEdge> edges,
           DelaunayMesh& mesh);
  /// Puts any triangulation of the exact points into `mesh`, which was begun with the rounded ones.
  bool cut(const ExactView& view, std::span<const FlatEdge> edges, DelaunayMesh& mesh);

 private:
  using Index = std::uint32_t;
  using Interval = IntervalOrder::Id;
  static constexpr Index kNone = IntervalOrder::kNone;

  // A corner of the front of an interval. It has the number of the link to the next one.
  struct FrontNode {
    Index point, previous, next;
  };
  // Where the sweep line is in the region, from the lower edge to the upper one. Its front are the
  // points right of all triangles so far, from the left end of one edge to that of the other.
  // Two neighbours of a point of the front are never a left turn away from being cut off.
  struct Bounds {
    Index lower, upper;  // edges
    Index low, high;     // the ends of the front: nodes
    Index latest;        // its rightmost node
  };
  // The edges at a point, from below, and the intervals that the point lies on the end of.
  struct Around {
    std::vector<Index> left, right;
    Interval below, above;  // kNone where the sweep line is outside there
    Interval previous;      // the last one that is wholly below
  };

  bool sweep(std::size_t point_count, std::span<const FlatEdge> edges);
  void index_edges(std::size_t point_count);
  void sort_around(Index point);
  bool visit(Index point);
  bool visit_left(Index point);
  bool visit_right(Index point);
  bool locate(Index point);
  bool close_between(Index point, std::size_t first, std::size_t last);
  bool open_between(Index point, std::size_t first, std::size_t last);
  void join_latest(Index point, Interval interval, bool split);
  void merge(Interval below, Interval above);

  Index add_node(Index point);
  bool cut_off(Index node, DelaunayMesh::Side seen);
  void advance_up(Index node);
  void advance_down(Index node);
  Index extend_low(Interval interval, Index point);
  Index extend_high(Interval interval, Index point);

  Index left_end(Index edge) const { return std::min(edges_[edge].from, edges_[edge].to); }
  Index right_end(Index edge) const { return std::max(edges_[edge].from, edges_[edge].to); }
  bool is_lower(Index edge) const { return edges_[edge].from < edges_[edge].to; }
  int turn(Index a, Index b, Index c) const;
  int side(Index edge, Index point) const { return turn(left_end(edge), right_end(edge), point); }
  bool apart(Index below, Index above) const;
  bool apart_from_neighbours(Interval interval) const;
  void set_lower(Interval interval, Index edge);
  void set_upper(Interval interval, Index edge);

  std::span<const exact::FlatPoint> points_;
  ExactView view_;
  std::span<const FlatEdge> edges_;
  DelaunayMesh* mesh_ = nullptr;
  std::vector<Index> first_, at_;      // the edges at each point
  std::vector<Interval> interval_of_;  // of the edges
  IntervalOrder order_;
  std::vector<Bounds> bounds_;
  std::vector<FrontNode> front_;
  Around around_;
};

}  // namespace strata
