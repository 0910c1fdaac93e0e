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
  const double triangles = static_cast<double>(input.triangles.size());
  // More cells than rays cost more than they save.
  const double cells = std::min(triangles, static_cast<double>(rays) * 16);
  build(rays < 4 ? 1 : std::clamp(static_cast<int>(std::sqrt(cells)), 1, 1024));
}

std::size_t WindingRays::cell(std::int32_t x, int k) const {
  const std::int64_t size = std::int64_t{high_[k]} - low_[k] + 1;
  return static_cast<std::size_t>((std::int64_t{x} - low_[k]) * across_ / size);
}

void WindingRays::build(int across) {
  across_ = across;
  const auto& vertices = input_.vertices;
  if (vertices.empty()) return;
  low_ = high_ = vertices.front();
  for (const LatticePoint& p : vertices) {
    low_ = glm::min(low_, p);
    high_ = glm::max(high_, p);
  }
  if (across_ == 1) return;
  const auto for_cells = [&](std::uint32_t t, const auto& work) {
    const glm::uvec3& c = input_.triangles[t];
    const LatticePoint &p = vertices[c.x], &q = vertices[c.y], &r = vertices[c.z];
    const LatticePoint low = glm::min(p, glm::min(q, r)), high = glm::max(p, glm::max(q, r));
    for (std::size_t z = cell(low.z, 2); z <= cell(high.z, 2); ++z) {
      for (std::size_t y = cell(low.y, 1); y <= cell(high.y, 1); ++y) {
        work(z * static_cast<std::size_t>(across_) + y);
      }
    }
  };
  const auto count = static_cast<std::uint32_t>(input_.triangles.size());
  first_.assign(static_cast<std::size_t>(across_) * static_cast<std::size_t>(across_) + 1, 0);
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
  if (across_ == 1) {
    const auto count = static_cast<std::uint32_t>(input_.triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) cross(t, place, normal, windings);
    return;
  }
  const LatticePoint& v = input_.vertices[place.v];
  const std::size_t c = cell(v.z, 2) * static_cast<std::size_t>(across_) + cell(v.y, 1);
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
