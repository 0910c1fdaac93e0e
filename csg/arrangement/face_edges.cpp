#include "csg/arrangement/face_edges.h"

#include <algorithm>
#include <array>
#include <span>
#include <tuple>

#include "core/buckets.h"
#include "exact/determinants.h"

namespace strata::csg {
namespace {

using Edge = FaceEdges::Edge;

constexpr std::uint32_t kNoPoint = 0xffffffffu;

// The edges of the result at a point, as far as they matter.
struct PointEdges {
  std::array<std::uint32_t, 2> neighbour{kNoPoint, kNoPoint};
  std::array<std::uint32_t, 2> line{};
  bool corner = false;  // more than two edges meet here
};

class EdgeJoiner {
 public:
  EdgeJoiner(const ArrangementInput& input, const BoundaryPoints& points, const CutLines& lines,
             FaceEdges edges)
      : input_(input),
        lines_(lines),
        edges_(std::move(edges)),
        at_(points.size()),
        stamp_(points.size(), 0) {}

  BoundaryFaces run();

 private:
  void add_neighbour(std::uint32_t point, std::uint32_t neighbour, std::uint32_t line);
  bool straight(const PointEdges& point) const;
  void find_straight();
  void add_planes();
  void add_plane(std::span<const Edge> edges);
  void add_chains(std::span<const Edge> edges);
  void add_touches();
  bool outward_positive(const Edge& edge) const;

  const ArrangementInput& input_;
  const CutLines& lines_;
  FaceEdges edges_;
  std::vector<PointEdges> at_;
  std::vector<bool> dropped_;
  std::vector<std::uint32_t> stamp_;
  std::uint32_t plane_number_ = 0;
  std::vector<std::uint32_t> plane_root_;  // of each plane of the result
  BoundaryFaces result_;
};

void EdgeJoiner::add_neighbour(std::uint32_t point, std::uint32_t neighbour, std::uint32_t line) {
  PointEdges& at = at_[point];
  for (int k = 0; k < 2; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (at.neighbour[i] == neighbour) return;
    if (at.neighbour[i] != kNoPoint) continue;
    at.neighbour[i] = neighbour;
    at.line[i] = line;
    return;
  }
  at.corner = true;
}

// Products of two components of directions: 2 (4b + 2) bits; 236 for b = 29.
bool EdgeJoiner::straight(const PointEdges& point) const {
  if (point.corner || point.neighbour[1] == kNoPoint) return false;
  if (point.line[0] == point.line[1]) return true;
  const exact::Cross d = direction_of(input_, lines_, point.line[0]),
                     e = direction_of(input_, lines_, point.line[1]);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (exact::product<exact::Int256>(d[i], e[j]) != exact::product<exact::Int256>(d[j], e[i])) {
      return false;
    }
  }
  return true;
}

void EdgeJoiner::find_straight() {
  for (const auto& whole : edges_.wholes) {
    for (int k = 0; k < 3; ++k) at_[whole.points[k]].corner = true;
  }
  for (const Edge& edge : edges_.edges) {
    add_neighbour(edge.from, edge.to, edge.line);
    add_neighbour(edge.to, edge.from, edge.line);
  }
  dropped_.assign(at_.size(), false);
  for (const Edge& edge : edges_.edges) {
    if (!dropped_[edge.from]) dropped_[edge.from] = straight(at_[edge.from]);
  }
}

// Normals of one plane are parallel, so the sign of their first component tells the sides apart.
bool EdgeJoiner::outward_positive(const Edge& edge) const {
  const exact::Normal n = input_.plane_of(edge.triangle).normal;
  const bool positive = n.x != 0 ? n.x > 0 : n.y != 0 ? n.y > 0 : n.z > 0;
  return positive != edge.turned;
}

void EdgeJoiner::add_planes() {
  const std::vector<Edge>& edges = edges_.edges;
  const detail::Buckets planes =
      detail::bucket(edges.size(), edges_.plane_of.size(),
                     [&](std::size_t i) { return edges_.plane_of[edges[i].triangle]; });
  struct Keyed {
    std::uint32_t label;
    bool positive;
    std::uint32_t edge;
    bool operator==(const Keyed& other) const {
      return label == other.label && positive == other.positive;
    }
    bool operator<(const Keyed& other) const {
      return std::tie(positive, label) < std::tie(other.positive, other.label);
    }
  };
  std::vector<Keyed> keyed;
  std::vector<Edge> group;
  for (std::uint32_t plane = 0; plane + 1 < planes.first.size(); ++plane) {
    keyed.clear();
    for (std::uint32_t i = planes.first[plane]; i < planes.first[plane + 1]; ++i) {
      const Edge& edge = edges[planes.items[i]];
      keyed.push_back({edge.label, outward_positive(edge), planes.items[i]});
    }
    if (!std::ranges::is_sorted(keyed, std::less())) std::ranges::sort(keyed, std::less());
    for (std::size_t i = 0; i < keyed.size();) {
      group.clear();
      const std::size_t first = i;
      for (; i < keyed.size() && keyed[i] == keyed[first]; ++i) {
        group.push_back(edges[keyed[i].edge]);
      }
      add_plane(group);
      plane_root_.push_back(plane);
    }
  }
}

void EdgeJoiner::add_plane(std::span<const Edge> edges) {
  BoundaryPlane plane;
  plane.plane = input_.plane_of(edges.front().triangle);
  if (edges.front().turned) plane.plane.normal = -plane.plane.normal;
  plane.label = edges.front().label;
  plane.first_edge = static_cast<std::uint32_t>(result_.edges.size());
  add_chains(edges);
  plane.edge_count = static_cast<std::uint32_t>(result_.edges.size()) - plane.first_edge;
  result_.planes.push_back(plane);
}

// An edge from a corner goes on through points that are dropped. The number of its wedge is that at
// its lesser end, since that is what the faces on both sides see.
void EdgeJoiner::add_chains(std::span<const Edge> edges) {
  std::vector<std::pair<std::uint32_t, const Edge*>> leaving;  // points that are dropped
  for (const Edge& edge : edges) {
    if (dropped_[edge.from]) leaving.emplace_back(edge.from, &edge);
  }
  std::ranges::sort(leaving, {}, [](const auto& x) { return x.first; });
  const auto onward = [&](const Edge& edge) -> const Edge* {
    auto at = std::ranges::lower_bound(leaving, edge.to, {}, [](const auto& x) { return x.first; });
    while (at->second->to == edge.from) ++at;
    return at->second;
  };
  for (const Edge& first : edges) {
    if (dropped_[first.from]) continue;
    const Edge* last = &first;
    while (dropped_[last->to]) last = onward(*last);
    const std::uint32_t wedge = first.from < last->to ? first.wedge : last->wedge;
    result_.edges.push_back({first.from, last->to, wedge});
  }
}

// Points that have edges elsewhere and none in the plane.
void EdgeJoiner::add_touches() {
  auto& inner = edges_.inner_points;
  std::erase_if(inner, [&](const FaceEdges::InnerPoint& p) {
    return dropped_[p.point] || (!at_[p.point].corner && at_[p.point].neighbour[0] == kNoPoint);
  });
  for (auto& p : inner) p.triangle = edges_.plane_of[p.triangle];
  const auto key = [](const FaceEdges::InnerPoint& p) { return std::tie(p.triangle, p.point); };
  std::ranges::sort(inner, [&](const auto& x, const auto& y) { return key(x) < key(y); });
  inner.erase(std::unique(inner.begin(), inner.end(),
                          [&](const auto& x, const auto& y) { return key(x) == key(y); }),
              inner.end());
  for (std::size_t i = 0; i < result_.planes.size(); ++i) {
    BoundaryPlane& plane = result_.planes[i];
    plane.first_touch = static_cast<std::uint32_t>(result_.touches.size());
    const auto first = std::lower_bound(
        inner.begin(), inner.end(), plane_root_[i],
        [](const FaceEdges::InnerPoint& p, std::uint32_t root) { return p.triangle < root; });
    const auto last = std::find_if(first, inner.end(), [&](const FaceEdges::InnerPoint& p) {
      return p.triangle != plane_root_[i];
    });
    const std::span points(first, last);
    if (points.empty()) continue;
    ++plane_number_;
    for (std::uint32_t e = plane.first_edge; e < plane.first_edge + plane.edge_count; ++e) {
      stamp_[result_.edges[e].from] = plane_number_;
    }
    for (const FaceEdges::InnerPoint& p : points) {
      if (stamp_[p.point] != plane_number_) result_.touches.push_back(p.point);
    }
    plane.touch_count = static_cast<std::uint32_t>(result_.touches.size()) - plane.first_touch;
  }
}

BoundaryFaces EdgeJoiner::run() {
  find_straight();
  add_planes();
  add_touches();
  result_.wholes = std::move(edges_.wholes);
  return std::move(result_);
}

}  // namespace

BoundaryFaces join_face_edges(const ArrangementInput& input, const BoundaryPoints& points,
                              const CutLines& lines, FaceEdges edges) {
  return EdgeJoiner(input, points, lines, std::move(edges)).run();
}

}  // namespace strata::csg
