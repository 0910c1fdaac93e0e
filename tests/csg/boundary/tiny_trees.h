#pragma once

// Random trees of closed solids whose vertices lie on whole numbers from 0 to 8, so that faces,
// edges and vertices coincide everywhere, and exact tests of points.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "exact/wide.h"
#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {

inline constexpr int kTinySide = 8;

/// Which solids a tree is made of.
enum class TinyKind { kBoxes, kConvex, kAny };

class TinyTrees {
 public:
  explicit TinyTrees(std::uint64_t seed) : random_(seed) {}

  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  std::mt19937_64& random() { return random_; }

  glm::dvec3 point() { return {pick(0, kTinySide), pick(0, kTinySide), pick(0, kTinySide)}; }

  TriangleSoup box() {
    glm::dvec3 low = point(), high = point();
    for (int k = 0; k < 3; ++k) {
      if (low[k] == high[k]) (low[k] > 0 ? low : high)[k] += low[k] > 0 ? -1 : 1;
      if (low[k] > high[k]) std::swap(low[k], high[k]);
    }
    return make_box(low, high);
  }

  TriangleSoup tetrahedron() {
    TriangleSoup mesh;
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    do {
      mesh.positions = {point(), point(), point(), point()};
    } while (signed_volume(mesh) == 0);
    return outward(std::move(mesh));
  }

  /// A triangle, pushed along an axis.
  TriangleSoup prism() {
    const int axis = pick(0, 2), from = pick(0, kTinySide - 1), to = pick(from + 1, kTinySide);
    TriangleSoup mesh;
    mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                      {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    do {
      mesh.positions = {point(), point(), point()};
      for (std::size_t i = 0; i < 3; ++i) {
        mesh.positions[i][axis] = from;
        mesh.positions.push_back(mesh.positions[i]);
        mesh.positions.back()[axis] = to;
      }
    } while (signed_volume(mesh) == 0);
    return outward(std::move(mesh));
  }

  /// The faces of random cubes: edges and vertices of it are often not manifold.
  TriangleSoup cells() {
    constexpr int kSide = 3;
    const int size = pick(1, 2);
    const glm::ivec3 at(pick(0, kTinySide - kSide * size), pick(0, kTinySide - kSide * size),
                        pick(0, kTinySide - kSide * size));
    std::array<bool, 27> filled{};
    for (bool& f : filled) f = pick(0, 1) == 1;
    filled[static_cast<std::size_t>(pick(0, 26))] = true;
    const auto is_filled = [&](const glm::ivec3& c) {
      for (int k = 0; k < 3; ++k) {
        if (c[k] < 0 || c[k] >= kSide) return false;
      }
      return filled[static_cast<std::size_t>((c.z * kSide + c.y) * kSide + c.x)];
    };
    TriangleSoup mesh;
    for (int i = 0; i < 27; ++i) {
      const glm::ivec3 cell(i % 3, i / 3 % 3, i / 9);
      if (!is_filled(cell)) continue;
      for (int side = 0; side < 6; ++side) {
        glm::ivec3 step(0);
        step[side / 2] = side % 2 == 0 ? -1 : 1;
        if (!is_filled(cell + step)) add_side(mesh, glm::dvec3(at + cell * size), size, side);
      }
    }
    return mesh;
  }

  /// An octahedron whose vertices lie anywhere: it intersects itself, and may be inside out.
  TriangleSoup crumpled() {
    TriangleSoup mesh;
    for (int i = 0; i < 6; ++i) mesh.positions.push_back(point());
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
  }

  /// A box whose sides have vertices that their neighbours do not have, or inner ones.
  TriangleSoup divided_box() {
    TriangleSoup mesh = box();
    for (int i = pick(1, 4); i > 0; --i) {
      const auto t = static_cast<std::size_t>(pick(0, static_cast<int>(mesh.triangles.size()) - 1));
      const glm::uvec3 old = mesh.triangles[t];
      const int k = pick(0, 2);
      const auto a = old[k], b = old[(k + 1) % 3], c = old[(k + 2) % 3];
      const glm::dvec3 m = glm::floor((mesh.positions[a] + mesh.positions[b]) / 2.0);
      const glm::dvec3 u = m - mesh.positions[a], v = mesh.positions[b] - m;
      if (glm::cross(u, v) != glm::dvec3(0) || glm::dot(u, v) <= 0) continue;
      mesh.positions.push_back(m);
      const auto middle = static_cast<std::uint32_t>(mesh.positions.size() - 1);
      mesh.triangles[t] = {a, middle, c};
      mesh.triangles.emplace_back(middle, b, c);
    }
    return mesh;
  }

  Solid solid(TinyKind kind) {
    Solid result;
    TriangleSoup mesh;
    switch (kind == TinyKind::kBoxes ? 0 : pick(0, kind == TinyKind::kConvex ? 4 : 8)) {
      case 0:
        mesh = box();
        break;
      case 1:
      case 2:
        mesh = tetrahedron();
        break;
      case 3:
      case 4:
        mesh = prism();
        break;
      case 5:
        mesh = cells();
        break;
      case 6:
        mesh = crumpled();
        result.rule = std::array{InsideRule::kWinding, InsideRule::kNonzero,
                                 InsideRule::kParity}[static_cast<std::size_t>(pick(0, 2))];
        break;
      case 7:
        mesh = divided_box();
        break;
      default:  // several in one mesh: winding numbers above 1
        mesh = box();
        append(mesh, prism());
        append(mesh, box());
    }
    result.mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
    return result;
  }

  /// A tree of at most `depth` operations above each solid.
  Tree tree(int depth, TinyKind kind) {
    Tree result;
    result.set_root(grow(result, depth, kind));
    return result;
  }

 private:
  static TriangleSoup outward(TriangleSoup mesh) {
    if (signed_volume(mesh) < 0) reverse_orientation(mesh);
    return mesh;
  }

  void add_side(TriangleSoup& mesh, const glm::dvec3& low, double size, int side) {
    const int k = side / 2, u = (k + 1) % 3, v = (k + 2) % 3;
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (int corner = 0; corner < 4; ++corner) {  // counter-clockwise about +k
      glm::dvec3 p = low;
      if (side % 2 == 1) p[k] += size;
      if (corner == 1 || corner == 2) p[u] += size;
      if (corner >= 2) p[v] += size;
      mesh.positions.push_back(p);
    }
    for (glm::uvec3 t : {glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3)}) {
      if (side % 2 == 0) std::swap(t.y, t.z);
      mesh.triangles.push_back(t + base);
    }
  }

  Tree::NodeId grow(Tree& tree, int depth, TinyKind kind) {
    if (depth == 0 || pick(0, 5) == 0) return tree.add_solid(solid(kind));
    std::vector<Tree::NodeId> operands;
    for (int i = pick(1, depth > 3 ? 2 : 3); i > 0; --i) {
      operands.push_back(grow(tree, depth - 1, kind));
    }
    constexpr Operation kOperations[] = {Operation::kUnion, Operation::kUnion,
                                         Operation::kDifference, Operation::kDifference,
                                         Operation::kIntersection};
    return tree.add(kOperations[pick(0, 4)], operands);
  }

  std::mt19937_64 random_;
};

/// Two unit cubes far outside of all tiny solids: united with any tiny tree they give one box, and
/// so one lattice, on which whole numbers are lattice points.
inline Tree tiny_frame() {
  return Tree(make_box(glm::dvec3(-4), glm::dvec3(-3))) |
         Tree(make_box(glm::dvec3(11), glm::dvec3(12)));
}

/// The winding number of a mesh around a point, by the crossings of a ray along x; nothing when the
/// point is on the surface or the ray meets an edge. Whole numbers below 2^36: products of three
/// differences fit.
class ExactWinding {
 public:
  using Whole = exact::Int128;
  using Point = std::array<Whole, 3>;
  static constexpr int kBits = 30;  ///< positions are multiples of 2^-30

  ExactWinding(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles)
      : triangles_(triangles.begin(), triangles.end()) {
    for (const glm::dvec3& p : positions) {
      points_.push_back(exact(p));
      for (int k = 0; k < 3; ++k) {
        const double scaled = std::ldexp(p[k], kBits);
        all_exact_ = all_exact_ && scaled == std::floor(scaled);
      }
    }
  }
  explicit ExactWinding(const TriangleSoup& mesh) : ExactWinding(mesh.positions, mesh.triangles) {}

  /// Whether all positions are multiples of 2^-30.
  bool all_exact() const { return all_exact_; }

  std::optional<int> at(const glm::dvec3& point) const {
    const Point p = exact(point);
    int winding = 0;
    for (const glm::uvec3& t : triangles_) {
      const Point &a = points_[t.x], &b = points_[t.y], &c = points_[t.z];
      const int sides[] = {side(p, a, b), side(p, b, c), side(p, c, a)};
      const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
      if (least < 0 && most > 0) continue;
      if (sides[0] * sides[1] * sides[2] == 0) {
        if (outside_box(p, a, b, c)) continue;
        return std::nullopt;
      }
      const int above = orient(a, b, c, p);  // 1: p lies to the outside
      if (above == 0) return std::nullopt;
      // Along +x the ray leaves through a triangle that faces +x: most > 0.
      if (most > 0 && above < 0) ++winding;
      if (least < 0 && above > 0) --winding;
    }
    return winding;
  }

 private:
  static Point exact(const glm::dvec3& p) {
    Point result;
    for (int k = 0; k < 3; ++k) {
      result[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::ldexp(p[k], kBits));
    }
    return result;
  }
  static int sign(Whole value) { return (value > 0) - (value < 0); }
  // Twice the area of (p, a, b) as seen from +x.
  static int side(const Point& p, const Point& a, const Point& b) {
    return sign((a[1] - p[1]) * (b[2] - p[2]) - (a[2] - p[2]) * (b[1] - p[1]));
  }
  static bool outside_box(const Point& p, const Point& a, const Point& b, const Point& c) {
    for (std::size_t k = 1; k < 3; ++k) {
      const auto [low, high] = std::minmax({a[k], b[k], c[k]});
      if (p[k] < low || p[k] > high) return true;
    }
    return std::max({a[0], b[0], c[0]}) < p[0];
  }
  static int orient(const Point& a, const Point& b, const Point& c, const Point& p) {
    const auto d = [&](const Point& q, std::size_t k) { return q[k] - a[k]; };
    const Whole x = d(b, 1) * d(c, 2) - d(b, 2) * d(c, 1),
                y = d(b, 2) * d(c, 0) - d(b, 0) * d(c, 2),
                z = d(b, 0) * d(c, 1) - d(b, 1) * d(c, 0);
    return sign(x * d(p, 0) + y * d(p, 1) + z * d(p, 2));
  }

  std::vector<Point> points_;
  std::vector<glm::uvec3> triangles_;
  bool all_exact_ = true;
};

}  // namespace strata::csg
