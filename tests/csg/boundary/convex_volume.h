#pragma once

// The exact volume of a tree of convex solids, by inclusion and exclusion: as a function of which
// solids hold a point, the tree is a sum of products, and a product is an intersection of convex
// solids, whose faces are clipped as polygons of fractions.

#include <array>
#include <functional>
#include <glm/vec3.hpp>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "strata/csg/tree.h"
#include "tests/csg/random_tree.h"
#include "tests/exact/exact_oracle.h"

namespace strata::csg {
namespace convex {

using exact::outer;
using exact::scalar;
using exact::operator+;
using exact::operator-;
using exact::operator*;

/// n . p <= d, whole numbers without common divisor.
struct HalfSpace {
  std::array<std::int64_t, 4> of{};

  exact::Fraction excess(const exact::Vector& p) const {
    return p[0] * of[0] + p[1] * of[1] + p[2] * of[2] - of[3];
  }
  friend auto operator<=>(const HalfSpace&, const HalfSpace&) = default;
};

/// Those whose intersection is a convex mesh with vertices on whole numbers.
inline std::set<HalfSpace> half_spaces_of(const TriangleSoup& mesh) {
  std::set<HalfSpace> result;
  for (const glm::uvec3& t : mesh.triangles) {
    using Vec = glm::vec<3, std::int64_t, glm::defaultp>;
    const Vec a(mesh.positions[t.x]), u = Vec(mesh.positions[t.y]) - a,
                                      v = Vec(mesh.positions[t.z]) - a;
    const Vec n(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
    const std::int64_t d = n.x * a.x + n.y * a.y + n.z * a.z;
    const std::int64_t g = std::gcd(std::gcd(n.x, n.y), std::gcd(n.z, d));
    if (n != Vec(0)) result.insert({{n.x / g, n.y / g, n.z / g, d / g}});
  }
  return result;
}

using ConvexPolygon = std::vector<exact::Vector>;

inline ConvexPolygon clip(const ConvexPolygon& polygon, const HalfSpace& half) {
  ConvexPolygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const exact::Vector &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const exact::Fraction at_p = half.excess(p), at_q = half.excess(q);
    if (at_p <= 0) result.push_back(p);
    if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0)) {
      result.push_back(p + exact::Fraction(at_p / (at_p - at_q)) * (q - p));
    }
  }
  return result;
}

/// A large rectangle in the plane of a half space, counter-clockwise from outside.
inline ConvexPolygon large_face(const HalfSpace& half) {
  const auto& [a, b, c, d] = half.of;
  const exact::Vector n{exact::Fraction(a), exact::Fraction(b), exact::Fraction(c)};
  const exact::Vector middle = exact::Fraction(exact::Fraction(d) / scalar(n, n)) * n;
  const exact::Vector side = a != 0 || b != 0
                                 ? exact::Vector{exact::Fraction(-b), exact::Fraction(a), 0}
                                 : exact::Vector{1, 0, 0};
  const exact::Vector up = outer(n, side);
  const exact::Fraction far = 100;
  return {middle + far * side, middle + far * up, middle - far * side, middle - far * up};
}

/// Six times the volume of an intersection of half spaces within [-30, 30]^3. Half spaces without a
/// face of it are taken out.
inline exact::Fraction six_volumes(std::set<HalfSpace>& halves) {
  exact::Fraction sum = 0;
  std::set<HalfSpace> kept;
  for (const HalfSpace& face : halves) {
    ConvexPolygon polygon = large_face(face);
    for (const HalfSpace& other : halves) {
      if (&other == &face || polygon.empty()) continue;
      polygon = clip(polygon, other);
    }
    exact::Fraction cone = 0;
    bool area = false;
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const exact::Vector across = outer(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
      area = area || across != exact::Vector{0, 0, 0};
      cone += scalar(polygon[0], across);
    }
    sum += cone;
    if (area) kept.insert(face);
  }
  halves = std::move(kept);
  return sum;
}

}  // namespace convex

/// The volume of a tree whose solids are convex, at places of no effect, with vertices on whole
/// numbers. @pre at most 16 solids
inline exact::Fraction convex_volume(const Tree& tree) {
  const std::size_t count = tree.solids().size();
  // f(x) = sum over S of coefficient(S) * product of x_i in S, by the transform of Moebius.
  std::vector<int> coefficient(std::size_t{1} << count);
  for (std::size_t set = 0; set < coefficient.size(); ++set) {
    coefficient[set] =
        evaluate(tree, tree.root(), [&](std::uint32_t s) { return (set >> s & 1) != 0; }) ? 1 : 0;
  }
  for (std::size_t s = 0; s < count; ++s) {
    for (std::size_t set = 0; set < coefficient.size(); ++set) {
      if ((set >> s & 1) != 0) coefficient[set] -= coefficient[set ^ std::size_t{1} << s];
    }
  }
  exact::Fraction total = 0;
  using convex::HalfSpace;
  const std::function<void(std::size_t, std::size_t, const std::set<HalfSpace>&)> visit =
      [&](std::size_t set, std::size_t next, const std::set<HalfSpace>& halves) {
        for (std::size_t s = next; s < count; ++s) {
          std::set<HalfSpace> with = halves;
          with.merge(convex::half_spaces_of(*tree.solids()[s].mesh));
          const exact::Fraction six = convex::six_volumes(with);
          if (six == 0) continue;
          const std::size_t larger = set | std::size_t{1} << s;
          total += six * coefficient[larger];
          visit(larger, s + 1, with);
        }
      };
  visit(0, 0, {});
  return total / 6;
}

}  // namespace strata::csg
