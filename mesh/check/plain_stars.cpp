#include "mesh/check/plain_stars.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "exact/determinants.h"

namespace strata {
namespace {

using exact::FilePoint;
using exact::filters::RealNormal;

// What each vertex is seen along, and the plane in which the half-plane lies: its normal is
// perpendicular to the direction. Both have whole numbers that a double holds.
struct View {
  RealNormal direction{0}, side{0};
};

// The sum of the triangles' normals, as whole numbers up to 2^30; the half-plane lies in no
// direction that is likely in a mesh.
template <class Point>
std::vector<View> views(std::span<const Point> points, std::span<const glm::uvec3> triangles) {
  std::vector<View> result(points.size());
  for (const glm::uvec3& t : triangles) {
    const RealNormal u(points[t.y] - points[t.x]), v(points[t.z] - points[t.x]);
    const RealNormal n = glm::cross(u, v);
    for (int k = 0; k < 3; ++k) result[t[k]].direction += n;
  }
  constexpr RealNormal kAxis(509, 757, 911);  // products with the direction: below 2^41
  for (View& view : result) {
    const RealNormal size = glm::abs(view.direction);
    const double most = std::max({size.x, size.y, size.z});
    if (most == 0) continue;
    view.direction = glm::round(view.direction / most * 0x1p30);
    view.side = glm::cross(view.direction, kAxis);
  }
  return result;
}

// 1: left of the half-plane, by less than half a turn; -1: right; 0: not known, or in its plane.
// Four roundings.
int side_of(const View& view, const RealNormal& v) {
  const double x = view.side.x * v.x, y = view.side.y * v.y, z = view.side.z * v.z;
  return exact::filtered_sign(x + y + z, std::abs(x) + std::abs(y) + std::abs(z));
}

}  // namespace

template <class Point>
std::vector<std::uint8_t> plain_stars(std::span<const Point> points,
                                      std::span<const glm::uvec3> triangles,
                                      const Execution& execution) {
  const std::vector<View> view = views(points, triangles);
  std::vector<std::uint8_t> plain(points.size(), 1);
  std::vector<std::uint32_t> turns(points.size());
  const auto spoil = [&](std::uint32_t v) {
    std::atomic_ref(plain[v]).store(0, std::memory_order_relaxed);
  };
  constexpr std::size_t kBlock = std::size_t{1} << 13;
  parallel_for(execution, (triangles.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t end = std::min(triangles.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) {
      const glm::uvec3& t = triangles[i];
      const RealNormal u(points[t.y] - points[t.x]), v(points[t.z] - points[t.x]);
      const exact::filters::BoundedCross normal = exact::filters::cross(u, v);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t at = t[k];
        const Point &a = points[t[(k + 1) % 3]], &b = points[t[(k + 2) % 3]];
        const int first = side_of(view[at], RealNormal(a - points[at])),
                  last = side_of(view[at], RealNormal(b - points[at]));
        if (first * last == 0 || exact::filters::dot(view[at].direction, normal).sign() <= 0) {
          spoil(at);
        } else if (first < 0 && last > 0) {
          std::atomic_ref(turns[at]).fetch_add(1, std::memory_order_relaxed);
        }
      }
    }
  });
  for (std::size_t v = 0; v < points.size(); ++v) plain[v] = plain[v] != 0 && turns[v] == 1;
  return plain;
}

template std::vector<std::uint8_t> plain_stars(std::span<const FilePoint>,
                                               std::span<const glm::uvec3>, const Execution&);
template std::vector<std::uint8_t> plain_stars(std::span<const exact::LatticePoint>,
                                               std::span<const glm::uvec3>, const Execution&);

}  // namespace strata
