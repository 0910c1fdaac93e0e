#include "csg/solids/plane_section.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <unordered_map>

#include "csg/solids/boundary.h"
#include "mesh/weld.h"

namespace strata::csg {
namespace {

/// Estimated steps for a point on the contour of a section: it passes through several flat
/// operations.
constexpr std::uint64_t kStepsOfPoint = 200;
constexpr std::uint64_t kStepsOfSegment = 10;  ///< a segment is chained and perhaps clipped away

/// Drops points far from a rectangle without changing winding numbers inside it. A run of points
/// that are all beyond the same side is replaced by its first and last point. Clipping the contour
/// at the rectangle would make overlapping edges, which Clipper does not always survive.
void shorten(std::vector<glm::dvec2>& contour, const Rectangle& rectangle) {
  const auto sides_beyond = [&](const glm::dvec2& p) {
    return (p.x < rectangle.low.x ? 1u : 0u) | (p.x > rectangle.high.x ? 2u : 0u) |
           (p.y < rectangle.low.y ? 4u : 0u) | (p.y > rectangle.high.y ? 8u : 0u);
  };
  std::size_t kept = 1;  // contour[kept - 1] is the end of the current run
  unsigned run = sides_beyond(contour[0]);
  bool has_end = false;  // the run has an end distinct from its start
  unsigned last = run;
  for (std::size_t i = 1; i < contour.size(); ++i) {
    const unsigned sides = sides_beyond(contour[i]);
    if (has_end && (run & sides) != 0) {
      contour[kept - 1] = contour[i];
      run &= sides;
    } else {
      run = last & sides;
      contour[kept++] = contour[i];
      has_end = run != 0;
    }
    last = sides;
  }
  contour.resize(kept);
}

/// The intersection of a leaf's surface with a plane, after an infinitesimal move of the plane.
class LeafSection {
 public:
  LeafSection(const Leaf& leaf, const Plane& plane, double tolerance, Side side)
      : leaf_(leaf),
        plane_(plane),
        tolerance_(tolerance),
        in_plane_is_above_(side == Side::kBelow) {}

  /// @param steps  is increased by the work done
  Outline run(const Rectangle* window, std::uint64_t& steps) {
    // The margin is far above the rounding of the boxes' distances.
    steps += leaf_.boxes.visit(plane_, 2.0 * tolerance_,
                               [&](std::uint32_t t) { add_triangle(leaf_.triangles[t]); });
    steps += kStepsOfSegment * segments_.size();
    Outline outline;
    for (std::size_t first = 0; first < segments_.size(); ++first) {
      if (segments_[first].used) continue;
      std::vector<glm::dvec2> contour;
      Edge at = segments_[first].from;
      for (std::size_t next = first; next != kNone; next = following(at)) {
        Segment& segment = segments_[next];
        segment.used = true;
        at = at == segment.from ? segment.to : segment.from;
        contour.push_back(crossing(at));
      }
      if (window && contour.size() >= 3) shorten(contour, *window);
      steps += kStepsOfPoint * contour.size();
      if (contour.size() >= 3) outline.contours.push_back(std::move(contour));
    }
    return outline.empty() ? outline : clean(outline, leaf_.fill);
  }

 private:
  using Edge = std::uint64_t;  // [lower vertex:32 | higher vertex:32]
  static constexpr std::size_t kNone = ~std::size_t{0};
  struct Segment {
    Edge from, to;
    bool used;
  };

  static Edge edge(std::uint32_t a, std::uint32_t b) {
    return Edge{std::min(a, b)} << 32 | std::max(a, b);
  }

  /// Signed distance of a vertex; 0 for vertices in the plane.
  double distance(std::uint32_t vertex) const {
    const double distance = glm::dot(leaf_.positions[vertex] - plane_.origin, plane_.normal);
    return std::abs(distance) <= tolerance_ ? 0.0 : distance;
  }

  void add_triangle(const glm::uvec3& t) {
    bool above[3];
    for (int i = 0; i < 3; ++i) {
      // A vertex in the plane is above a plane that is moved down, and below one that is moved up.
      const double d = distance(t[i]);
      above[i] = d == 0.0 ? in_plane_is_above_ : d > 0.0;
    }
    const int count = above[0] + above[1] + above[2];
    if (count == 0 || count == 3) return;
    int odd = 0;  // the corner that is alone on its side of the plane
    while (above[odd] != (count == 1)) ++odd;
    const Edge from = edge(t[odd], t[(odd + 1) % 3]), to = edge(t[(odd + 2) % 3], t[odd]);
    // The region lies to the left, seen from above.
    segments_.push_back(count == 1 ? Segment{from, to, false} : Segment{to, from, false});
    link(segments_.back().from);
    // Faces of opposite orientation may meet here. The even-odd rule needs closed lines but not a
    // consistent direction.
    if (leaf_.fill == Fill::kEvenOdd) link(segments_.back().to);
  }

  /// Notes that the last segment can be continued at `edge`.
  void link(Edge edge) {
    const auto [at, is_new] = last_link_.try_emplace(edge, links_.size());
    links_.push_back({segments_.size() - 1, is_new ? kNone : at->second});
    at->second = links_.size() - 1;
  }

  std::size_t following(Edge edge) {
    const auto found = last_link_.find(edge);
    if (found == last_link_.end()) return kNone;
    std::size_t& at = found->second;
    while (at != kNone && segments_[links_[at].segment].used) at = links_[at].before;
    return at == kNone ? kNone : links_[at].segment;
  }

  glm::dvec2 crossing(Edge edge) const {
    const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
    const glm::dvec3 p = leaf_.positions[a] - plane_.origin, q = leaf_.positions[b] - plane_.origin;
    const double from = distance(a), t = from / (from - distance(b));  // signs differ
    const glm::dvec3 at = t <= 0.0 ? p : t >= 1.0 ? q : p + t * (q - p);
    return {glm::dot(at, plane_.u), glm::dot(at, plane_.v)};
  }

  const Leaf& leaf_;
  const Plane& plane_;
  double tolerance_;
  bool in_plane_is_above_;
  std::vector<Segment> segments_;
  struct Link {
    std::size_t segment, before;  // before: the previous link at the same edge
  };
  std::vector<Link> links_;
  std::unordered_map<Edge, std::size_t> last_link_;
};

}  // namespace

Plane make_plane(const glm::dvec3& origin, const glm::dvec3& normal) {
  Plane plane;
  plane.origin = origin;
  plane.normal = normal;
  const glm::dvec3 size = glm::abs(normal);
  const glm::dvec3 axis = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                          : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                               : glm::dvec3(0, 0, 1);
  plane.u = glm::normalize(glm::cross(axis, normal));
  plane.v = glm::cross(normal, plane.u);
  return plane;
}

Rectangle rectangle_of(const Plane& plane) {
  Rectangle rectangle;
  for (unsigned i = 0; i < 8; ++i) {
    const glm::dvec3 corner(i & 1u ? plane.window.high.x : plane.window.low.x,
                            i & 2u ? plane.window.high.y : plane.window.low.y,
                            i & 4u ? plane.window.high.z : plane.window.low.z);
    rectangle.low = glm::min(rectangle.low, plane.flat(corner));
    rectangle.high = glm::max(rectangle.high, plane.flat(corner));
  }
  const glm::dvec2 margin = 1e-3 * (rectangle.high - rectangle.low);
  rectangle.low -= margin;
  rectangle.high += margin;
  return rectangle;
}

bool meet(const Bounds& box, const Bounds& other, double margin) {
  for (int i = 0; i < 3; ++i) {
    if (other.low[i] > box.high[i] + margin || other.high[i] < box.low[i] - margin) return false;
  }
  return true;
}

void BoxTree::build(std::span<const glm::dvec3> positions, std::vector<glm::uvec3>& triangles) {
  nodes_.clear();
  if (triangles.empty()) return;
  nodes_.push_back({{}, 0, static_cast<std::uint32_t>(triangles.size()), 0});
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node node = nodes_[i];
    Bounds box;
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t) {
      for (int corner = 0; corner < 3; ++corner) {
        box.low = glm::min(box.low, positions[triangles[t][corner]]);
        box.high = glm::max(box.high, positions[triangles[t][corner]]);
      }
    }
    nodes_[i].box = box;
    if (node.count <= kFew) continue;
    const glm::dvec3 size = box.high - box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto at = [&](const glm::uvec3& t) {
      return positions[t.x][axis] + positions[t.y][axis] + positions[t.z][axis];
    };
    const auto begin = triangles.begin() + node.first;
    const std::uint32_t half = node.count / 2;
    std::nth_element(begin, begin + half, begin + node.count,
                     [&](const glm::uvec3& a, const glm::uvec3& b) { return at(a) < at(b); });
    nodes_[i].children = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({{}, node.first, half, 0});
    nodes_.push_back({{}, node.first + half, node.count - half, 0});
  }
}

Leaf make_leaf(const Solid& solid) {
  Leaf leaf;
  const TriangleSoup mesh = world_mesh(solid);
  detail::WeldTable<double> table(mesh.positions.size());
  std::vector<std::uint32_t> index(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    index[i] = detail::find_or_keep(table, leaf.positions, mesh.positions[i]);
  }
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::uvec3 welded(index[t.x], index[t.y], index[t.z]);
    if (welded.x == welded.y || welded.y == welded.z || welded.z == welded.x) continue;
    leaf.triangles.push_back(welded);
  }
  leaf.boxes.build(leaf.positions, leaf.triangles);
  leaf.box = bounds(mesh);
  leaf.fill = solid.rule == InsideRule::kParity ? Fill::kEvenOdd : Fill::kNonzero;
  return leaf;
}

Outline section(const Leaf& leaf, const Plane& plane, double tolerance, Side side,
                std::uint64_t& steps) {
  if (plane.window.empty()) {
    return LeafSection(leaf, plane, tolerance, side).run(nullptr, steps);
  }
  if (!meet(leaf.box, plane.window, tolerance)) return {};
  const Rectangle window = rectangle_of(plane);
  return LeafSection(leaf, plane, tolerance, side).run(&window, steps);
}

}  // namespace strata::csg
