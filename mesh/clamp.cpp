#include "mesh/clamp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

namespace strata {
namespace {

using Polygon = std::vector<glm::dvec3>;

/// The point where the segment from `a` to `b` meets the plane `coordinate[axis] = at`. Two
/// neighbouring triangles hold the segment in opposite directions, so it is always walked from its
/// smaller end. This also keeps accuracy.
glm::dvec3 cut_segment(glm::dvec3 a, glm::dvec3 b, int axis, double at) {
  const auto key = [](const glm::dvec3& p) {
    return std::array{std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), p.x, p.y, p.z};
  };
  if (key(b) < key(a)) std::swap(a, b);
  glm::dvec3 p = a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis]));
  p[axis] = at;
  return p;
}

/// Cuts polygons at planes and flattens the parts beyond.
class Clamper {
 public:
  explicit Clamper(const Bounds& box) : box_(box) {}

  /// The pieces of a triangle. Each of them stays flat.
  std::span<const Polygon> pieces(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    pieces_.assign(1, Polygon{a, b, c});
    for (int axis = 0; axis < 3; ++axis) {
      at_plane(axis, box_.low[axis], 1.0);
      at_plane(axis, box_.high[axis], -1.0);
    }
    return pieces_;
  }

 private:
  /// @param sign  1 moves the part below the plane; -1 moves the part above
  void at_plane(int axis, double at, double sign) {
    const std::size_t count = pieces_.size();
    for (std::size_t i = 0; i < count; ++i) {
      bool any_in = false, any_out = false;
      for (const glm::dvec3& p : pieces_[i]) {
        const double side = sign * (p[axis] - at);
        any_in |= side > 0, any_out |= side < 0;
      }
      if (!any_out) continue;
      const Polygon whole = std::move(pieces_[i]);
      Polygon kept, moved;
      for (std::size_t k = 0; k < whole.size(); ++k) {
        const glm::dvec3 &p = whole[k], &q = whole[(k + 1) % whole.size()];
        const double at_p = sign * (p[axis] - at), at_q = sign * (q[axis] - at);
        if (at_p >= 0) kept.push_back(p);
        if (at_p <= 0) moved.push_back(p);
        if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) {
          const glm::dvec3 between = cut_segment(p, q, axis, at);
          kept.push_back(between);
          moved.push_back(between);
        }
      }
      for (glm::dvec3& p : moved) p[axis] = at;
      pieces_[i] = std::move(moved);
      if (any_in) pieces_.push_back(std::move(kept));
    }
  }

  Bounds box_;
  std::vector<Polygon> pieces_;
};

}  // namespace

ClampedMesh clamp_to_box(std::span<const glm::dvec3> positions,
                         std::span<const glm::uvec3> triangles, const Bounds& box,
                         const std::stop_token& stop) {
  ClampedMesh out;
  out.positions.reserve(positions.size());
  for (const glm::dvec3& p : positions) out.positions.push_back(glm::clamp(p, box.low, box.high));
  out.triangles.reserve(triangles.size());
  out.sources.reserve(triangles.size());
  const auto add = [&](const glm::uvec3& t, std::uint32_t source) {
    const glm::dvec3 &a = out.positions[t.x], &b = out.positions[t.y], &c = out.positions[t.z];
    if (a == b || b == c || c == a) return;
    out.triangles.push_back(t);
    out.sources.push_back(source);
  };
  Clamper clamper(box);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (i % 4096 == 0 && stop.stop_requested()) break;
    const glm::uvec3& t = triangles[i];
    const glm::dvec3 &a = positions[t.x], &b = positions[t.y], &c = positions[t.z];
    const glm::dvec3 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
    bool bent = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double at : {box.low[axis], box.high[axis]}) {
        bent |= low[axis] < at && at < high[axis];
      }
    }
    if (!bent) {
      add(t, i);
      continue;
    }
    for (const Polygon& piece : clamper.pieces(a, b, c)) {
      const auto first = static_cast<std::uint32_t>(out.positions.size());
      out.positions.insert(out.positions.end(), piece.begin(), piece.end());
      for (std::uint32_t k = 2; k < piece.size(); ++k) {
        add({first, first + k - 1, first + k}, i);
      }
    }
  }
  return out;
}

}  // namespace strata
