#include "csg/arrangement/winding_rays.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "core/buckets.h"

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

// 30 and 118 bits.
int turn(const LatticePoint& edge, const exact::Cross& v) {
  return sign_of(exact::product<exact::Int192>(v[2], edge.y) -
                 exact::product<exact::Int192>(v[1], edge.z));
}

class Rays {
 public:
  Rays(const ArrangementInput& input, const BoundaryPoints& points, std::span<const Nearby> places);

  struct Passed {
    std::uint32_t place;
    SolidCount count;
  };
  // Appends the rays that pass through a triangle.
  void add(std::uint32_t triangle, std::vector<Passed>& out) const;

 private:
  // Rounding leaves a point within the bounds of whole steps that it lies in.
  LatticePoint steps(const Nearby& place) const {
    return LatticePoint(points_.rounded(place.point) >> exact::FilePoint(exact::kFileBits));
  }
  int column(int axis, std::int32_t at) const {
    return static_cast<int>((std::int64_t{at} - low_[axis]) / size_[axis]);
  }
  int cross(std::uint32_t triangle, const Nearby& place) const;

  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  const std::span<const Nearby> places_;
  // Places in cells over y and z.
  LatticePoint low_, high_;
  int across_ = 1;
  glm::i64vec3 size_{1};
  detail::Buckets cells_;
};

Rays::Rays(const ArrangementInput& input, const BoundaryPoints& points,
           std::span<const Nearby> places)
    : input_(input), points_(points), places_(places), low_(steps(places[0])), high_(low_) {
  for (const Nearby& place : places) {
    low_ = glm::min(low_, steps(place));
    high_ = glm::max(high_, steps(place));
  }
  across_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(places.size()))), 1, 256);
  size_ = (glm::i64vec3(high_) - glm::i64vec3(low_)) / std::int64_t{across_} + std::int64_t{1};
  const auto cells = static_cast<std::size_t>(across_) * static_cast<std::size_t>(across_);
  cells_ = detail::bucket(places.size(), cells, [&](std::size_t i) {
    const LatticePoint p = steps(places[i]);
    return static_cast<std::size_t>(column(2, p.z) * across_ + column(1, p.y));
  });
}

void Rays::add(std::uint32_t triangle, std::vector<Passed>& out) const {
  const glm::uvec3& t = input_.triangles[triangle];
  const LatticePoint &a = input_.vertices[t.x], &b = input_.vertices[t.y],
                     &c = input_.vertices[t.z];
  LatticePoint low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
  for (int k = 0; k < 3; ++k) {
    if (low[k] > high_[k] || (k > 0 && high[k] < low_[k])) return;
  }
  low = glm::max(low, low_);
  high = glm::min(high, high_);
  for (int row = column(2, low.z); row <= column(2, high.z); ++row) {
    const std::uint32_t
        first = cells_.first[static_cast<std::size_t>(row * across_ + column(1, low.y))],
        end = cells_.first[static_cast<std::size_t>(row * across_ + column(1, high.y) + 1)];
    for (std::uint32_t i = first; i < end; ++i) {
      const int winding = cross(triangle, places_[cells_.items[i]]);
      if (winding == 0) continue;
      for (const auto& [solid, count] : input_.solids.content(triangle)) {
        out.push_back({cells_.items[i], {solid, winding * count}});
      }
    }
  }
}

// Of each quantity the value at the point decides, else its change along the edge, across it and
// along the normal, in this order. These three are independent, so one of them does.
int Rays::cross(std::uint32_t triangle, const Nearby& place) const {
  const auto& vertices = input_.vertices;
  const glm::uvec3& t = input_.triangles[triangle];
  const LatticePoint corners[3] = {vertices[t.x], vertices[t.y], vertices[t.z]};
  const exact::FilePoint at = points_.rounded(place.point);
  for (int k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax({corners[0][k], corners[1][k], corners[2][k]});
    if (at[k] < std::int64_t{low} << exact::kFileBits) return 0;
    if (k > 0 && at[k] > std::int64_t{high} << exact::kFileBits) return 0;
  }
  const exact::Plane plane = exact::plane_through(corners[0], corners[1], corners[2]);
  const int facing = sign_of(plane.normal.x);
  if (facing == 0) return 0;  // seen from its edge
  const Normal normal = input_.plane_of(place.triangle).normal;
  for (int k = 0; k < 3; ++k) {
    const LatticePoint edge = corners[k == 2 ? 0 : k + 1] - corners[k];
    const exact::Plane wall{Normal(0, -std::int64_t{edge.z}, edge.y), corners[k]};  // along x
    int left = side_of(points_, place.point, wall);
    if (left == 0) left = turn(edge, place.along);
    if (left == 0) left = turn(edge, Normal(place.across));
    if (left == 0) left = turn(edge, normal);
    if (left != facing) return 0;
  }
  int above = side_of(points_, place.point, plane);
  if (above == 0) above = sign_of(exact::dot(plane.normal, place.along));
  if (above == 0) above = sign_of(exact::dot(plane.normal, place.across));
  if (above == 0) above = sign_of(exact::dot(plane.normal, normal));
  if (above != facing) return 0;  // it lies towards +x
  return -facing;
}

}  // namespace

void merge_counts(std::vector<SolidCount>& counts) {
  std::ranges::sort(counts, {}, &SolidCount::solid);
  std::size_t kept = 0;
  for (const SolidCount& one : counts) {
    if (kept > 0 && counts[kept - 1].solid == one.solid) {
      counts[kept - 1].count += one.count;
    } else {
      counts[kept++] = one;
    }
  }
  counts.resize(kept);
}

Result<std::vector<std::vector<SolidCount>>> count_windings(const ArrangementInput& input,
                                                            const BoundaryPoints& points,
                                                            std::span<const Nearby> places,
                                                            const Execution& execution) {
  std::vector<std::vector<SolidCount>> result(places.size());
  if (places.empty()) return result;
  constexpr std::size_t kBlock = 8192;
  const Rays rays(input, points, places);
  std::vector<std::vector<Rays::Passed>> passed((input.triangles.size() + kBlock - 1) / kBlock);
  parallel_for(execution, passed.size(), [&](std::size_t block, int) {
    const std::size_t end = std::min(input.triangles.size(), (block + 1) * kBlock);
    for (std::size_t t = block * kBlock; t < end; ++t) {
      rays.add(static_cast<std::uint32_t>(t), passed[block]);
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  for (const auto& some : passed) {
    for (const auto& [place, count] : some) result[place].push_back(count);
  }
  for (std::vector<SolidCount>& counts : result) {
    merge_counts(counts);
    std::erase_if(counts, [](const SolidCount& c) { return c.count == 0; });
  }
  return result;
}

}  // namespace strata::csg
