#include "csg/arrangement/winding_rays.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace strata::csg {
namespace {

using exact::Int128;
using exact::LatticePoint;
using exact::Normal;
using exact::sign_of;

// The turn from an edge to a vector, seen along x: y and z are at most 30 and 59 bits.
int turn(const LatticePoint& edge, const Normal& v) {
  return sign_of(Int128{edge.y} * v.z - Int128{edge.z} * v.y);
}

}  // namespace

WindingRays::WindingRays(const ArrangementInput& input, std::size_t rays) : input_(input) {
  if (rays >= 4 && !input.triangles.empty()) build(rays);
}

std::size_t WindingRays::cell(const LatticePoint& p) const {
  return (static_cast<std::size_t>(p.z) - static_cast<std::size_t>(low_.z)) / size_[1] * across_ +
         (static_cast<std::size_t>(p.y) - static_cast<std::size_t>(low_.y)) / size_[0];
}

// Cells about as large as the triangles seen along x, and not many more than there are rays.
void WindingRays::build(std::size_t rays) {
  const auto& vertices = input_.vertices;
  const auto count = static_cast<std::uint32_t>(input_.triangles.size());
  LatticePoint high = vertices.front();
  low_ = high;
  for (const LatticePoint& p : vertices) {
    low_ = glm::min(low_, p);
    high = glm::max(high, p);
  }
  struct Shadow {
    LatticePoint low, high;
    bool seen;
  };
  const auto shadow = [&](std::uint32_t t) {
    const glm::uvec3& c = input_.triangles[t];
    const LatticePoint &p = vertices[c.x], &q = vertices[c.y], &r = vertices[c.z];
    return Shadow{glm::min(p, glm::min(q, r)), glm::max(p, glm::max(q, r)),
                  exact::normal_of(p, q, r).x != 0};
  };
  double extents[2] = {0, 0};
  std::uint32_t seen = 0;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Shadow s = shadow(t);
    if (!s.seen) continue;
    ++seen;
    for (int k = 0; k < 2; ++k) extents[k] += static_cast<double>(s.high[k + 1]) - s.low[k + 1] + 1;
  }
  std::size_t cells[2];
  const double most = std::sqrt(16.0 * static_cast<double>(rays));
  for (int k = 0; k < 2; ++k) {
    const double whole = static_cast<double>(high[k + 1]) - low_[k + 1] + 1;
    const double wanted = std::clamp(whole * seen / std::max(extents[k], 1.0), 1.0, most);
    size_[k] = static_cast<std::size_t>(whole / wanted) + 1;
    cells[k] = static_cast<std::size_t>(whole) / size_[k] + 1;
  }
  across_ = cells[0];
  const auto for_cells = [&](std::uint32_t t, const auto& work) {
    const Shadow s = shadow(t);
    if (!s.seen) return;
    const std::size_t first = cell(s.low), last = cell(s.high);
    const std::size_t columns = last % across_ - first % across_ + 1;
    for (std::size_t row = first; row <= last; row += across_) {
      for (std::size_t c = row; c < row + columns; ++c) work(c);
    }
  };
  first_.assign(cells[0] * cells[1] + 1, 0);
  for (std::uint32_t t = 0; t < count; ++t) for_cells(t, [&](std::size_t c) { ++first_[c + 1]; });
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  triangles_.resize(first_.back());
  for (std::uint32_t t = 0; t < count; ++t) {
    for_cells(t, [&](std::size_t c) { triangles_[next[c]++] = t; });
  }
}

void WindingRays::count(const Nearby& place, std::vector<std::int32_t>& windings) const {
  const Normal normal = input_.plane_of(place.triangle).normal;
  if (first_.empty()) {
    const auto count = static_cast<std::uint32_t>(input_.triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) cross(t, place, normal, windings);
    return;
  }
  const LatticePoint& v = input_.vertices[place.v];
  const std::size_t c = cell(v);
  for (std::uint32_t i = first_[c]; i < first_[c + 1]; ++i) {
    cross(triangles_[i], place, normal, windings);
  }
}

// Of each quantity the value at v decides, else its change along u, w and the normal, in this
// order. These three are independent, so one of them does.
void WindingRays::cross(std::uint32_t triangle, const Nearby& place, const Normal& normal,
                        std::vector<std::int32_t>& windings) const {
  const auto& vertices = input_.vertices;
  const glm::uvec3& t = input_.triangles[triangle];
  const LatticePoint corners[3] = {vertices[t.x], vertices[t.y], vertices[t.z]};
  const LatticePoint& v = vertices[place.v];
  const auto [y0, y1] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const auto [z0, z1] = std::minmax({corners[0].z, corners[1].z, corners[2].z});
  if (v.y < y0 || v.y > y1 || v.z < z0 || v.z > z1) return;
  if (v.x < std::min({corners[0].x, corners[1].x, corners[2].x})) return;
  const exact::Plane plane = exact::plane_through(corners[0], corners[1], corners[2]);
  const int facing = sign_of(plane.normal.x);
  if (facing == 0) return;  // seen from its edge
  const LatticePoint along = vertices[place.u] - v, across = vertices[place.w] - v;
  for (int k = 0; k < 3; ++k) {
    const LatticePoint edge = corners[k == 2 ? 0 : k + 1] - corners[k];
    int side = turn(edge, Normal(v - corners[k]));
    if (side == 0) side = turn(edge, Normal(along));
    if (side == 0) side = turn(edge, Normal(across));
    if (side == 0) side = turn(edge, normal);
    if (side != facing) return;
  }
  int above = sign_of(exact::height(plane, v));
  if (above == 0) above = sign_of(exact::dot(plane.normal, along));
  if (above == 0) above = sign_of(exact::dot(plane.normal, across));
  if (above == 0) above = sign_of(exact::dot(plane.normal, normal));
  if (above != facing) return;  // it lies towards +x
  for (const auto& [solid, count] : input_.solids.content(triangle)) {
    windings[solid] -= facing * count;
  }
}

}  // namespace strata::csg
