#include "mesh/polygons/refine_delaunay.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "mesh/polygons/plane_predicates.h"

// Flips edges one at a time until all satisfy Delaunay's rule: C. L. Lawson, "Software for C1
// surface interpolation", 1977.

namespace strata::detail {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

class Refinement {
 public:
  Refinement(std::span<const glm::dvec2> points, std::vector<glm::uvec3>& triangles)
      : points_(points), triangles_(triangles), across_(triangles.size(), {kNone, kNone, kNone}) {
    find_neighbours();
  }

  void run() {
    // An edge in the queue is a triangle and a number. Edge k runs from corner k to the next one.
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (across_[t][k] != kNone && across_[t][k] / 3 > t) waiting_.push_back(3 * t + k);
      }
    }
    for (std::size_t left = 64 * triangles_.size(); left > 0 && !waiting_.empty();) {
      const std::uint32_t edge = waiting_.back();
      waiting_.pop_back();
      if (turn(edge)) --left;
    }
  }

 private:
  void find_neighbours() {
    struct Side {
      std::uint32_t low, high, edge;
      bool operator<(const Side& other) const {
        return low != other.low     ? low < other.low
               : high != other.high ? high < other.high
                                    : edge < other.edge;
      }
    };
    std::vector<Side> sides;
    sides.reserve(3 * triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t a = corner(3 * t + k), b = corner(3 * t + (k + 1) % 3);
        sides.push_back({std::min(a, b), std::max(a, b), 3 * t + k});
      }
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 1; i < sides.size(); ++i) {
      if (sides[i - 1].low != sides[i].low || sides[i - 1].high != sides[i].high) continue;
      set_across(sides[i - 1].edge, sides[i].edge);
      ++i;
    }
  }

  std::uint32_t corner(std::uint32_t edge) const {
    return triangles_[edge / 3][static_cast<int>(edge % 3)];
  }
  void set_across(std::uint32_t edge, std::uint32_t other) {
    if (edge != kNone) across_[edge / 3][edge % 3] = other;
    if (other != kNone) across_[other / 3][other % 3] = edge;
  }

  /// Flips an edge if it violates Delaunay's rule.
  bool turn(std::uint32_t edge) {
    const std::uint32_t other = across_[edge / 3][edge % 3];
    if (other == kNone) return false;
    const std::uint32_t t = edge / 3, o = other / 3;
    const std::uint32_t after = 3 * t + (edge + 1) % 3, before = 3 * t + (edge + 2) % 3;
    const std::uint32_t other_after = 3 * o + (other + 1) % 3,
                        other_before = 3 * o + (other + 2) % 3;
    // The edge runs from a to c; b is on its right, d on its left.
    const std::uint32_t a = corner(edge), c = corner(after), d = corner(before),
                        b = corner(other_before);
    if (delaunay_cut(points_[a], points_[b], points_[c], points_[d]) >= 0 ||
        orient(points_[a], points_[b], points_[d]) <= 0 ||
        orient(points_[b], points_[c], points_[d]) <= 0) {
      return false;
    }
    const std::uint32_t ab = across_[other_after / 3][other_after % 3],
                        bc = across_[other_before / 3][other_before % 3],
                        cd = across_[after / 3][after % 3], da = across_[before / 3][before % 3];
    triangles_[t] = {a, b, d};
    triangles_[o] = {b, c, d};
    set_across(3 * t, ab);
    set_across(3 * t + 2, da);
    set_across(3 * o, bc);
    set_across(3 * o + 1, cd);
    set_across(3 * t + 1, 3 * o + 2);
    for (const std::uint32_t side : {3 * t, 3 * t + 2, 3 * o, 3 * o + 1}) waiting_.push_back(side);
    return true;
  }

  std::span<const glm::dvec2> points_;
  std::vector<glm::uvec3>& triangles_;
  std::vector<std::array<std::uint32_t, 3>> across_;  ///< the edge in the neighbouring triangle
  std::vector<std::uint32_t> waiting_;
};

}  // namespace

void refine_delaunay(std::span<const glm::dvec2> points, std::vector<glm::uvec3>& triangles) {
  if (triangles.size() > 1) Refinement(points, triangles).run();
}

}  // namespace strata::detail
