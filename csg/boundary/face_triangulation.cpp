#include "csg/boundary/face_triangulation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "exact/directions.h"

namespace strata::csg {
namespace {

using exact::RationalPoint;

// The sweep goes to the right and a little up, so that rows of holes along the axes are met one
// hole at a time. Coordinates differ by at most 2^53, so keys of their differences are below 2^63.
constexpr std::int64_t kRight = 509, kUp = 197;

struct ExactCorner {
  RationalPoint point;
  exact::Int256 key;  // along the sweep, over point.w: at most 12 S^7 * 706, 217 bits for b = 29

  ExactCorner(const RationalPoint& p, int u, int v)
      : point(p),
        key(exact::product<exact::Int256>(exact::numerator(p, u), kRight) +
            exact::product<exact::Int256>(exact::numerator(p, v), kUp)) {}
};

// The sign of a / a_weight - b / b_weight. Products: 217 + 178 bits for b = 29.
}  // namespace

// Most faces that were cut are triangles still.
bool FaceTriangulation::append_triangle(const BoundaryPlane& plane, FaceTriangles& out) const {
  const BoundaryEdge* e = faces_.edges.data() + plane.first_edge;
  const int second = e[1].from == e[0].to ? 1 : 2;
  const BoundaryEdge &p = e[0], &q = e[second], &r = e[3 - second];
  if (p.to != q.from || q.to != r.from || r.to != p.from) return false;
  const auto flat = [this](Index point) {
    return exact::FlatPoint(positions_[point][u_], positions_[point][v_]);
  };
  if (exact::orient2d(flat(p.from), flat(q.from), flat(r.from)) <= 0) return false;
  const auto triangle = static_cast<Index>(out.triangles.size());
  out.triangles.emplace_back(p.from, q.from, r.from);
  if (p.wedge != 0) out.wedges.push_back({triangle, 0, p.wedge});
  if (q.wedge != 0) out.wedges.push_back({triangle, 1, q.wedge});
  if (r.wedge != 0) out.wedges.push_back({triangle, 2, r.wedge});
  return true;
}

// Most others are convex quadrilaterals. @return false for whatever is none
bool FaceTriangulation::append_quad(const BoundaryPlane& plane, FaceTriangles& out) const {
  std::array<BoundaryEdge, 4> e;
  std::copy_n(faces_.edges.data() + plane.first_edge, 4, e.begin());
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t next = i + 1;
    while (next < 4 && e[next].from != e[i].to) ++next;
    if (next == 4) return false;
    std::swap(e[i + 1], e[next]);
  }
  if (e[3].to != e[0].from) return false;
  std::array<exact::FlatPoint, 4> at;
  for (std::size_t i = 0; i < 4; ++i) {
    at[i] = {positions_[e[i].from][u_], positions_[e[i].from][v_]};
  }
  const auto key = [&](std::size_t i) {
    const exact::FlatPoint along = at[i] - at[0];
    return std::pair(kRight * along.x + kUp * along.y, along.y);
  };
  std::size_t first = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (exact::orient2d(at[i], at[(i + 1) % 4], at[(i + 2) % 4]) <= 0) return false;
    if (key(i) < key(first)) first = i;
  }
  // The four turns are left and add up to one turn: a quadrilateral cannot turn twice.
  const int inside = exact::incircle(at[0], at[1], at[2], at[3]);
  const std::size_t a = inside != 0 ? (inside > 0 ? 1 : 0) : first % 2;  // an end of the diagonal
  const auto triangle = static_cast<Index>(out.triangles.size());
  for (const std::size_t i : {a, a + 2}) {
    out.triangles.emplace_back(e[i].from, e[(i + 1) % 4].from, e[(i + 2) % 4].from);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t place = (i + 4 - a) % 4;
    if (e[i].wedge == 0) continue;
    out.wedges.push_back(
        {triangle + static_cast<Index>(place / 2), static_cast<Index>(place % 2), e[i].wedge});
  }
  return true;
}

void FaceTriangulation::collect(const BoundaryPlane& plane) {
  corners_.clear();
  exact::FlatPoint first(0);
  const auto add = [&](Index point) {
    const exact::FilePoint& at = positions_[point];
    const exact::FlatPoint flat(at[u_], at[v_]);
    if (corners_.empty()) first = flat;
    corners_.push_back({kRight * (flat.x - first.x) + kUp * (flat.y - first.y), flat, point});
  };
  for (Index i = 0; i < plane.edge_count; ++i) add(faces_.edges[plane.first_edge + i].from);
  for (Index i = 0; i < plane.touch_count; ++i) add(faces_.touches[plane.first_touch + i]);
}

// Sorts the corners. @return false when two of them coincide
bool FaceTriangulation::sort_corners() {
  std::sort(corners_.begin(), corners_.end());
  std::size_t count = 0;
  bool distinct = true;
  for (const Corner& corner : corners_) {
    if (count > 0 && corners_[count - 1].point == corner.point) continue;
    if (count > 0 && corners_[count - 1].at == corner.at) distinct = false;
    corners_[count++] = corner;
  }
  corners_.resize(count);
  return distinct;
}

// @return false when an edge ends in a point at which none starts
bool FaceTriangulation::number_edges(const BoundaryPlane& plane) {
  if (!number_of_) number_of_.reset(new Index[positions_.size()]);
  flat_.clear();
  for (const Corner& corner : corners_) {
    number_of_[corner.point] = static_cast<Index>(flat_.size());
    flat_.push_back(corner.at);
  }
  edges_.clear();
  for (Index i = 0; i < plane.edge_count; ++i) {
    const BoundaryEdge& edge = faces_.edges[plane.first_edge + i];
    const Index to = number_of_[edge.to];  // anything, if the point is none of the plane
    if (to >= corners_.size() || corners_[to].point != edge.to) return false;
    edges_.push_back({number_of_[edge.from], to});
  }
  return true;
}

bool FaceTriangulation::cut_exactly(const BoundaryPlane& plane) {
  std::vector<std::pair<ExactCorner, Corner>> corners;
  corners.reserve(corners_.size());
  for (const Corner& corner : corners_) {
    corners.emplace_back(ExactCorner(faces_.points.rational(corner.point), u_, v_), corner);
  }
  std::sort(corners.begin(), corners.end(), [this](const auto& a, const auto& b) {
    const RationalPoint &p = a.first.point, &q = b.first.point;
    const int order = exact::compare_fractions(a.first.key, p.w, b.first.key, q.w);
    return (order != 0 ? order
                       : exact::compare_fractions(exact::numerator(p, v_), p.w,
                                                  exact::numerator(q, v_), q.w)) < 0;
  });
  std::vector<RationalPoint> rational;
  rational.reserve(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    rational.push_back(corners[i].first.point);
    corners_[i] = corners[i].second;
  }
  if (!number_edges(plane)) return false;
  mesh_.begin(flat_);
  if (!sweep_.cut(FaceSweep::ExactView{rational, u_, v_}, edges_, mesh_)) return false;
  mesh_.straighten();
  return true;
}

void FaceTriangulation::append_mesh(const BoundaryPlane& plane, FaceTriangles& out) const {
  const std::size_t before = out.triangles.size();
  for (Index t = 0; t < mesh_.triangle_count(); ++t) {
    const auto& [a, b, c] = mesh_.triangle(t);
    out.triangles.emplace_back(corners_[a].point, corners_[b].point, corners_[c].point);
    for (Index k = 0; k < 3; ++k) {
      const DelaunayMesh::Side side = mesh_.across(3 * t + k);
      if (!DelaunayMesh::is_outline(side)) continue;
      const Index wedge = faces_.edges[plane.first_edge + DelaunayMesh::number(side)].wedge;
      if (wedge != 0) out.wedges.push_back({static_cast<Index>(before) + t, k, wedge});
    }
  }
}

bool FaceTriangulation::append(std::uint32_t index, FaceTriangles& out) {
  const BoundaryPlane& plane = faces_.planes[index];
  const exact::PlaneView view(plane.plane);
  u_ = view.u();
  v_ = view.v();
  bool simple = true;
  const Index few = plane.touch_count == 0 ? plane.edge_count : 0;
  if (!(few == 3 && append_triangle(plane, out)) && !(few == 4 && append_quad(plane, out))) {
    collect(plane);
    simple = sort_corners() && number_edges(plane) && sweep_.cut(flat_, edges_, mesh_);
    if (!simple && !cut_exactly(plane)) return false;
    append_mesh(plane, out);
  }
  out.labels.resize(out.triangles.size(), plane.label);
  out.planes.resize(out.triangles.size(), simple ? index : index | FaceTriangles::kNotSimple);
  return true;
}

}  // namespace strata::csg
