#pragma once

// What two triangles share, by its definition and in fractions: slow and obvious. Shares no code
// with mesh/check.

#include <array>
#include <vector>

namespace strata::oracle {

/// Coordinates are a type of fractions, such as boost's cpp_rational.
template <class Fraction>
struct Geometry {
  using Point = std::array<Fraction, 3>;
  using Corners = std::array<Point, 3>;

  static Point minus(const Point& a, const Point& b) {
    return {Fraction(a[0] - b[0]), Fraction(a[1] - b[1]), Fraction(a[2] - b[2])};
  }
  static Point along(const Point& a, const Fraction& t, const Point& u) {
    return {Fraction(a[0] + t * u[0]), Fraction(a[1] + t * u[1]), Fraction(a[2] + t * u[2])};
  }
  static Point cross(const Point& a, const Point& b) {
    return {Fraction(a[1] * b[2] - a[2] * b[1]), Fraction(a[2] * b[0] - a[0] * b[2]),
            Fraction(a[0] * b[1] - a[1] * b[0])};
  }
  static Fraction dot(const Point& a, const Point& b) {
    return Fraction(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
  }
  static bool zero(const Point& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }
  static Point normal(const Corners& t) { return cross(minus(t[1], t[0]), minus(t[2], t[0])); }

  static bool in_segment(const Point& p, const Point& a, const Point& b) {
    return zero(cross(minus(p, a), minus(p, b))) && dot(minus(p, a), minus(p, b)) <= 0;
  }

  /// Whether a point lies in a triangle, its boundary included.
  static bool in_triangle(const Point& p, const Corners& t) {
    const Point n = normal(t);
    if (zero(n)) {
      return in_segment(p, t[0], t[1]) || in_segment(p, t[1], t[2]) || in_segment(p, t[2], t[0]);
    }
    if (dot(n, minus(p, t[0])) != 0) return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const Point &a = t[i], &b = t[(i + 1) % 3];
      if (dot(n, cross(minus(b, a), minus(p, a))) < 0) return false;
    }
    return true;
  }

  /// Points whose convex hull is what the triangles share: vertices of one in the other, points
  /// where an edge passes through the plane of the other, points where two edges cross.
  static std::vector<Point> shared_points(const Corners& a, const Corners& b) {
    std::vector<Point> points;
    const auto keep = [&](const Point& p) {
      if (!in_triangle(p, a) || !in_triangle(p, b)) return;
      for (const Point& other : points) {
        if (other == p) return;
      }
      points.push_back(p);
    };
    for (std::size_t i = 0; i < 3; ++i) {
      keep(a[i]);
      keep(b[i]);
    }
    const auto pass = [&](const Corners& edges, const Corners& plane) {
      const Point n = normal(plane);
      for (std::size_t i = 0; i < 3; ++i) {
        const Point &p = edges[i], u = minus(edges[(i + 1) % 3], p);
        const Fraction slope = dot(n, u);
        if (slope != 0) keep(along(p, Fraction(dot(n, minus(plane[0], p)) / slope), u));
      }
    };
    pass(a, b);
    pass(b, a);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {  // p + s u = q + t v: s (u x v) = (q - p) x v
        const Point &p = a[i], &q = b[j];
        const Point u = minus(a[(i + 1) % 3], p), v = minus(b[(j + 1) % 3], q), w = cross(u, v);
        if (zero(w) || dot(w, minus(q, p)) != 0) continue;
        keep(along(p, Fraction(dot(cross(minus(q, p), v), w) / dot(w, w)), u));
      }
    }
    return points;
  }

  enum class Shares { kNothing, kVertex, kEdge, kTouches, kCrosses, kArea };

  static Shares compare(const Corners& a, const Corners& b) {
    const std::vector<Point> points = shared_points(a, b);
    if (points.empty()) return Shares::kNothing;
    const auto vertex_of_both = [&](const Point& p) {
      return (p == a[0] || p == a[1] || p == a[2]) && (p == b[0] || p == b[1] || p == b[2]);
    };
    if (points.size() == 1) return vertex_of_both(points[0]) ? Shares::kVertex : Shares::kTouches;
    // The ends of the segment that they span, if it is one.
    Point low = points[0], high = points[0];
    for (const Point& p : points) {
      if (p < low) low = p;
      if (high < p) high = p;
    }
    for (const Point& p : points) {
      if (!in_segment(p, low, high)) return Shares::kArea;
    }
    if (vertex_of_both(low) && vertex_of_both(high)) return Shares::kEdge;
    return passes_through(a, b) && passes_through(b, a) ? Shares::kCrosses : Shares::kTouches;
  }

  /// Whether `a` has points on both sides of the plane of `b`.
  static bool passes_through(const Corners& a, const Corners& b) {
    bool above = false, below = false;
    for (const Point& p : a) {
      const Fraction height = dot(normal(b), minus(p, b[0]));
      above = above || height > 0;
      below = below || height < 0;
    }
    return above && below;
  }
};

}  // namespace strata::oracle
