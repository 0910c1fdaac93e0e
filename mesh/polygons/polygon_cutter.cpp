#include "mesh/polygons/polygon_cutter.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

#include "mesh/polygons/plane_predicates.h"
#include "mesh/polygons/refine_delaunay.h"
#include "mesh/polygons/triangulate.h"

namespace strata {
namespace {

/// A polygon this flat, relative to its size, has one surface: the choice of diagonals moves it by
/// less than voxels and pixels resolve.
constexpr double kFlat = 1e-6;
/// A polygon is also flat if rounding its corners to float could have bent it this much (2^-24 of
/// the coordinates per corner), unless the bend is large for its size.
constexpr double kFloat = 0x1p-22, kFlatFloat = 1e-4;
/// See Bend::large().
constexpr double kLarge = 1e-3;
/// Limits that keep the square of twice an area and products of coordinates from overflowing.
constexpr double kMostSquare = 1e300, kMostCoordinate = 1e150;

/// The view along the axis in which a normal is longest.
struct View {
  int u, v;
  double sign;
  explicit View(const glm::dvec3& normal) {
    const glm::dvec3 size = glm::abs(normal);
    const int along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    u = (along + 1) % 3;
    v = (along + 2) % 3;
    sign = normal[along] > 0.0 ? 1.0 : -1.0;
  }
  glm::dvec2 of(const glm::dvec3& p) const { return {p[u], sign * p[v]}; }
};

bool least_first(const glm::dvec3& p, const glm::dvec3& q) {
  if (p.x != q.x) return p.x < q.x;
  return p.y != q.y ? p.y < q.y : p.z < q.z;
}

bool left_first(const glm::dvec2& p, const glm::dvec2& q) {
  return (p.x < q.x) | ((p.x == q.x) & (p.y < q.y));  // no branches: they would be mispredicted
}

/// Whether a quadrilateral turns to the left at all corners, by more than rounding could explain.
bool surely_convex(const glm::dvec2 (&p)[4]) {
  constexpr double kRounding = 1e-15;
  bool sure = true;
  for (int i = 0; i < 4; ++i) {
    const glm::dvec2 in = p[(i + 1) % 4] - p[i], out = p[(i + 2) % 4] - p[(i + 1) % 4];
    const double left = in.x * out.y, right = in.y * out.x;
    sure &= left - right > kRounding * (std::abs(left) + std::abs(right));
  }
  return sure;
}

/// Whether the diagonal of a quadrilateral runs from its first corner to the third.
bool quad_is_fan(const glm::dvec2 (&p)[4]) {
  if (!surely_convex(p)) {
    const bool fan_fits = orient(p[0], p[1], p[2]) > 0 && orient(p[0], p[2], p[3]) > 0;
    const bool other_fits = orient(p[1], p[2], p[3]) > 0 && orient(p[1], p[3], p[0]) > 0;
    if (fan_fits != other_fits) return fan_fits;
    if (!fan_fits) return true;  // it crosses itself, or two corners coincide
  }
  if (const int side = detail::delaunay_cut(p[0], p[1], p[2], p[3]); side != 0) return side > 0;
  // The cut of PolygonSweep, which proceeds from the right.
  int left = 0, right = 0;
  for (int i = 1; i < 4; ++i) {
    left = left_first(p[i], p[left]) ? i : left;
    right = left_first(p[right], p[i]) ? i : right;
  }
  const int start = (left + 2) % 4 == right ? left + 1 : right;
  return start % 2 == 0;
}

}  // namespace

bool Bend::large() const { return height > kLarge * size; }

std::string Bend::text() const {
  return fmt::format("its corners deviate {:.3g} from a plane, and the polygon is {:.3g} long",
                     height, size);
}

QuadCut cut_quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                 const glm::dvec3& d) {
  QuadCut result;
  const glm::dvec3 ab = b - a, ac = c - a, bd = d - b;
  const glm::dvec3 normal = glm::cross(ac, bd);  // twice the area vector
  const double square = glm::dot(normal, normal);
  if (!(square > 0.0 && square < kMostSquare)) return result;
  // a and c have the same height, and so have b and d.
  const double height = std::abs(glm::dot(normal, ab));
  const glm::dvec3 extent =
      glm::max(glm::max(a, b), glm::max(c, d)) - glm::min(glm::min(a, b), glm::min(c, d));
  const double size_square = glm::dot(extent, extent);
  const double reach = std::max(std::max(std::abs(a.x), std::abs(a.y)), std::abs(a.z));
  // All values are squared and multiplied by the square of the normal.
  const double spread = height * height, whole = square * size_square;
  const bool flat =
      spread <= kFlat * kFlat * whole || (spread <= kFloat * kFloat * reach * reach * square &&
                                          spread <= kFlatFloat * kFlatFloat * whole);
  // The areas of the four triangles that the diagonals a-c and b-d make.
  const double abc = glm::dot(normal, glm::cross(ab, ac)),
               bcd = glm::dot(normal, glm::cross(c - b, bd));
  if (flat && abc > 0.0 && abc < square && bcd > 0.0 && bcd < square) return result;
  if (spread > kLarge * kLarge * whole) {
    result.bend = {height / std::sqrt(square), std::sqrt(size_square)};
  }
  const View view(normal);
  result.fan = quad_is_fan({view.of(a), view.of(b), view.of(c), view.of(d)});
  return result;
}

/// Measures normal, size and bend. @return false when there is no plane to cut in
bool PolygonCutter::measure(std::span<const glm::dvec3> corners) {
  bend_ = {};
  normal_ = glm::dvec3(0.0);
  const glm::dvec3 about = corners[0];
  glm::dvec3 low = about, high = about;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    if (i + 1 < corners.size()) normal_ += glm::cross(corners[i] - about, corners[i + 1] - about);
    low = glm::min(low, corners[i]);
    high = glm::max(high, corners[i]);
  }
  const double square = glm::dot(normal_, normal_);
  const glm::dvec3 reach = glm::max(glm::abs(low), glm::abs(high));
  if (!(square > 0.0 && square < kMostSquare) ||
      !(std::max({reach.x, reach.y, reach.z}) < kMostCoordinate)) {
    return false;
  }
  double least = 0.0, most = 0.0;
  for (const glm::dvec3& corner : corners) {
    const double height = glm::dot(normal_, corner - about);
    least = std::min(least, height);
    most = std::max(most, height);
  }
  bend_ = {(most - least) / std::sqrt(square), glm::length(high - low)};
  flat_ = bend_.height <= kFlat * bend_.size ||
          (bend_.height <= kFloat * std::max({reach.x, reach.y, reach.z}) &&
           bend_.height <= kFlatFloat * bend_.size);
  return true;
}

/// Whether points_ turn to the left everywhere and go around once.
bool PolygonCutter::convex() const {
  const std::size_t count = points_.size();
  int turns_back = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec2 &p = points_[i], &q = points_[i + 1 < count ? i + 1 : 0],
                     &r = points_[i + 2 < count ? i + 2 : i + 2 - count];
    const glm::dvec2 in = q - p, out = r - q;
    if (!(in.x * out.y - in.y * out.x > 0.0)) return false;
    turns_back += left_first(q, p) && left_first(q, r) ? 1 : 0;
  }
  return turns_back == 1;
}

/// Drops corners that repeat the previous one and rotates the polygon to begin at its least corner.
void PolygonCutter::begin_at_least_corner(std::span<const glm::dvec3> corners) {
  const std::size_t count = corners.size();
  const auto corner = [&](std::size_t i) -> const glm::dvec3& { return corners[i % count]; };
  // Several corners may be in the least place; then the corners that follow decide. Two candidates
  // are compared. If they differ after k equal corners, the loser is out, and so are the k
  // candidates after it.
  std::size_t least = 0;
  for (std::size_t other = 1, k = 0; other < count && k < count;) {
    const glm::dvec3 &p = corner(least + k), &q = corner(other + k);
    if (p == q) {
      ++k;
      continue;
    }
    if (least_first(q, p)) {
      const std::size_t beyond = least + k + 1;
      least = other;
      other = std::max(beyond, other + 1);
    } else {
      other += k + 1;
    }
    k = 0;
  }
  corner_.clear();
  for (std::size_t i = least; i < least + count; ++i) {
    if (!corner_.empty() && corners[corner_.back()] == corner(i)) continue;
    corner_.push_back(static_cast<std::uint32_t>(i % count));
  }
  while (corner_.size() > 1 && corners[corner_.back()] == corners[corner_.front()]) {
    corner_.pop_back();
  }
}

/// Numbers the points. Points at the same position in space have the same number.
void PolygonCutter::number_places(std::span<const glm::dvec3> corners) {
  const auto count = static_cast<std::uint32_t>(points_.size());
  const auto at = [&](std::uint32_t i) -> const glm::dvec3& { return corners[corner_[i]]; };
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return at(a) != at(b) ? least_first(at(a), at(b)) : a < b;
  });
  place_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool again = i > 0 && at(order[i]) == at(order[i - 1]);
    place_[order[i]] = again ? place_[order[i - 1]] : order[i];
  }
}

std::pair<std::uint32_t, std::uint32_t> PolygonCutter::edge(std::uint32_t a,
                                                            std::uint32_t b) const {
  return std::minmax({place_[a], place_[b]});
}

/// Removes edges that the polygon follows in both directions. @return the successor of each point
std::vector<std::uint32_t> PolygonCutter::without_bridges() const {
  const auto count = static_cast<std::uint32_t>(points_.size());
  std::vector<std::uint32_t> next(count), edges(count);
  for (std::uint32_t i = 0; i < count; ++i) next[i] = (i + 1) % count, edges[i] = i;
  const auto ends = [&](std::uint32_t i) { return edge(i, (i + 1) % count); };
  std::sort(edges.begin(), edges.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(ends(a), a) < std::pair(ends(b), b);
  });
  for (std::size_t i = 1; i < count; ++i) {
    const std::uint32_t a = edges[i - 1], b = edges[i];
    if (ends(a) != ends(b) || place_[a] == place_[b]) continue;
    std::swap(next[a], next[b]);
    ++i;
  }
  return next;
}

/// Whether the triangles use each edge of the outline once in its direction, and every other edge
/// equally often in both directions.
bool PolygonCutter::keeps_outline() const {
  struct Use {
    std::pair<std::uint32_t, std::uint32_t> edge;
    int times;
  };
  std::vector<Use> uses;
  const auto use = [&](std::uint32_t a, std::uint32_t b, int times) {
    if (place_[a] != place_[b])
      uses.push_back({edge(a, b), place_[a] < place_[b] ? times : -times});
  };
  const auto count = static_cast<std::uint32_t>(points_.size());
  for (std::uint32_t i = 0; i < count; ++i) use(i, (i + 1) % count, -1);
  for (const glm::uvec3& t : triangles_) use(t.x, t.y, 1), use(t.y, t.z, 1), use(t.z, t.x, 1);
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.edge < b.edge; });
  int balance = 0;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    balance += uses[i].times;
    const bool last = i + 1 == uses.size() || uses[i + 1].edge != uses[i].edge;
    if (last && balance != 0) return false;
  }
  return true;
}

/// Triangulates points_ that cross or touch each other. A hole that is joined to the outline by an
/// edge in both directions becomes a contour of its own.
/// @return false when the triangles would not keep the outline in space, for example because
/// corners above each other coincide in the view
bool PolygonCutter::cut_by_ears(std::span<const glm::dvec3> corners) {
  number_places(corners);
  const std::vector<std::uint32_t> next = without_bridges();
  std::vector<std::vector<glm::dvec2>> contours;
  std::vector<std::uint32_t> vertices;  // the points of all contours
  std::vector<bool> seen(points_.size(), false);
  for (std::uint32_t start = 0; start < points_.size(); ++start) {
    std::vector<glm::dvec2> contour;
    const std::size_t before = vertices.size();
    for (std::uint32_t i = start; !seen[i]; i = next[i]) {
      seen[i] = true;
      if (!contour.empty() && place_[vertices.back()] == place_[i]) continue;
      contour.push_back(points_[i]);
      vertices.push_back(i);
    }
    while (contour.size() > 1 && place_[vertices[before]] == place_[vertices.back()]) {
      contour.pop_back();
      vertices.pop_back();
    }
    if (contour.size() >= 3) {
      contours.push_back(std::move(contour));
    } else {
      vertices.resize(before);
    }
  }
  triangles_ = triangulate(contours);
  for (glm::uvec3& t : triangles_) t = {vertices[t.x], vertices[t.y], vertices[t.z]};
  std::erase_if(triangles_,
                [](const glm::uvec3& t) { return t.x == t.y || t.y == t.z || t.z == t.x; });
  return triangles_.size() <= points_.size() - 2 && keeps_outline();
}

std::span<const glm::uvec3> PolygonCutter::cut(std::span<const glm::dvec3> corners) {
  triangles_.clear();
  if (!measure(corners)) return {};
  const View view(normal_);
  points_.clear();
  for (const glm::dvec3& corner : corners) points_.push_back(view.of(corner));
  if (flat_ && convex()) return {};
  begin_at_least_corner(corners);
  const std::size_t count = corner_.size();
  if (count < 3) return {};
  points_.clear();
  for (const std::uint32_t i : corner_) points_.push_back(view.of(corners[i]));
  if (count == 4) {
    const bool fan = quad_is_fan({points_[0], points_[1], points_[2], points_[3]});
    if (fan) {
      triangles_ = {{0, 1, 2}, {0, 2, 3}};
    } else {
      triangles_ = {{1, 2, 3}, {1, 3, 0}};
    }
  } else {
    if (!sweep_.cut(points_, triangles_) && !cut_by_ears(corners)) {
      triangles_.clear();
      for (std::uint32_t i = 2; i < count; ++i) triangles_.emplace_back(0, i - 1, i);
    }
    if (!flat_) detail::refine_delaunay(points_, triangles_);
  }
  for (glm::uvec3& t : triangles_) t = {corner_[t.x], corner_[t.y], corner_[t.z]};
  return triangles_;
}

}  // namespace strata
