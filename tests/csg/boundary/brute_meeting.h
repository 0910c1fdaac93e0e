#pragma once

// Whether two triangles of a mesh meet elsewhere than in vertices and edges of both, by comparing
// all pairs with integers.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "exact/wide.h"
#include "strata/mesh/solid_mesh.h"

namespace strata::csg {

/// @pre positions are multiples of 2^-30 and below 2^5
class BruteMeeting {
 public:
  /// Two triangles that meet where they must not.
  static std::optional<std::pair<std::size_t, std::size_t>> find(const SolidMesh& mesh) {
    std::vector<Corners> triangles;
    for (const glm::uvec3& t : mesh.triangles) {
      triangles.push_back({exact_point(mesh.positions[t.x]), exact_point(mesh.positions[t.y]),
                           exact_point(mesh.positions[t.z])});
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (!boxes_apart(triangles[i], triangles[j]) && meet(triangles[i], triangles[j])) {
          return std::pair(j, i);
        }
      }
    }
    return std::nullopt;
  }

 private:
  using Whole = exact::Int128;
  using Point = std::array<Whole, 3>;
  using Corners = std::array<Point, 3>;

  static Point exact_point(const glm::dvec3& p) {
    return {static_cast<std::int64_t>(std::ldexp(p.x, 30)),
            static_cast<std::int64_t>(std::ldexp(p.y, 30)),
            static_cast<std::int64_t>(std::ldexp(p.z, 30))};
  }
  static int sign(Whole value) { return (value > 0) - (value < 0); }
  static Point minus(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }
  static Point cross(const Point& u, const Point& v) {
    return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  }
  static int orient(const Point& a, const Point& b, const Point& c, const Point& p) {
    const Point n = cross(minus(b, a), minus(c, a)), d = minus(p, a);
    return sign(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]);
  }
  static bool boxes_apart(const Corners& s, const Corners& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::max({s[0][k], s[1][k], s[2][k]}) < std::min({t[0][k], t[1][k], t[2][k]}) ||
          std::max({t[0][k], t[1][k], t[2][k]}) < std::min({s[0][k], s[1][k], s[2][k]})) {
        return true;
      }
    }
    return false;
  }

  // In the plane of a triangle, seen along an axis in which it has an area.
  static bool flat_meets(const Point& p, const Point& q, const Corners& t) {
    const Point n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    const std::size_t k = n[0] != 0 ? 0 : n[1] != 0 ? 1 : 2, u = (k + 1) % 3, v = (k + 2) % 3;
    const auto turn = [&](const Point& a, const Point& b, const Point& c) {
      return sign((b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]));
    };
    const auto within = [&](const Point& x) {
      const auto [low, high] =
          std::minmax({turn(t[0], t[1], x), turn(t[1], t[2], x), turn(t[2], t[0], x)});
      return low >= 0 || high <= 0;
    };
    if (within(p) || within(q)) return true;
    for (std::size_t i = 0; i < 3; ++i) {
      const Point &a = t[i], &b = t[(i + 1) % 3];
      bool apart = false;  // as segments of one line may be
      for (const std::size_t axis : {u, v}) {
        apart = apart || std::max(a[axis], b[axis]) < std::min(p[axis], q[axis]) ||
                std::max(p[axis], q[axis]) < std::min(a[axis], b[axis]);
      }
      if (apart) continue;
      if (turn(p, q, a) * turn(p, q, b) <= 0 && turn(a, b, p) * turn(a, b, q) <= 0) return true;
    }
    return false;
  }

  // Whether a segment and a triangle, with their ends and edges, share a point.
  static bool meets(const Point& p, const Point& q, const Corners& t) {
    const int at_p = orient(t[0], t[1], t[2], p), at_q = orient(t[0], t[1], t[2], q);
    if (at_p * at_q > 0) return false;
    if (at_p == 0 && at_q == 0) return flat_meets(p, q, t);
    const auto [low, high] =
        std::minmax({orient(p, q, t[0], t[1]), orient(p, q, t[1], t[2]), orient(p, q, t[2], t[0])});
    return low >= 0 || high <= 0;
  }

  static bool meet(const Corners& s, const Corners& t) {
    std::vector<std::size_t> of_s, of_t;  // corners that the other has too
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::find(t.begin(), t.end(), s[i]) != t.end()) of_s.push_back(i);
      if (std::find(s.begin(), s.end(), t[i]) != s.end()) of_t.push_back(i);
    }
    if (of_s.size() == 3) return true;
    if (of_s.size() == 2) {  // a common edge: they meet elsewhere when they lie on each other
      const Point &a = s[of_s[0]], &b = s[of_s[1]];
      const Point &c = s[3 - of_s[0] - of_s[1]], &d = t[3 - of_t[0] - of_t[1]];
      if (orient(a, b, c, d) != 0) return false;
      const Point m = cross(minus(b, a), minus(c, a)), n = cross(minus(b, a), minus(d, a));
      for (std::size_t k = 0; k < 3; ++k) {
        if (m[k] != 0) return sign(m[k]) == sign(n[k]);
      }
      return true;
    }
    // The edges that do not contain the common corner touch nothing of the other triangle.
    const auto edges_meet = [](const Corners& of, const std::vector<std::size_t>& shared,
                               const Corners& other) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t next = (i + 1) % 3;
        if (!shared.empty() && (shared[0] == i || shared[0] == next)) continue;
        if (meets(of[i], of[next], other)) return true;
      }
      return false;
    };
    return edges_meet(s, of_s, t) || edges_meet(t, of_t, s);
  }
};

}  // namespace strata::csg
