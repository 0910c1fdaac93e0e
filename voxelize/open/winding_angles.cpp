#include "voxelize/open/winding_angles.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/open/winding_angles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "raster/triangle_setup.h"

// This work is based on:
// A. van Oosterom, J. Strackee: The Solid Angle of a Plane Triangle, 1983.
// M. Abramowitz, I. A. Stegun: Handbook of Mathematical Functions, 4.4.49: the arc tangent.

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lane = hn::CappedTag<double, WindingPoints::kStep>;
using Vec = hn::Vec<Lane>;

/// A vector of points or differences. Products and sums are kept apart: fused ones round otherwise.
struct Vec3 {
  Vec x, y, z;
};
HWY_INLINE Vec dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vec3 splat(const glm::dvec3& p) {
  const Lane d;
  return {hn::Set(d, p.x), hn::Set(d, p.y), hn::Set(d, p.z)};
}
/// (a - p) * scale
HWY_INLINE Vec3 offset(const glm::dvec3& a, const Vec3& p, const Vec3& scale) {
  const Vec3 from = splat(a);
  return {hn::Mul(hn::Sub(from.x, p.x), scale.x), hn::Mul(hn::Sub(from.y, p.y), scale.y),
          hn::Mul(hn::Sub(from.z, p.z), scale.z)};
}

/// atan2 to 2e-8, without libm, whose last bits differ between machines. 0 for (0, 0).
HWY_INLINE Vec arc(Vec y, Vec x) {
  const Lane d;
  constexpr double kTerms[] = {-0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393,
                               -0.1420889944, 0.1999355085, -0.3333314528, 1.0};
  const Vec ax = hn::Abs(x), ay = hn::Abs(y);
  const Vec t = hn::Div(hn::Min(ax, ay), hn::Max(hn::Max(ax, ay), hn::Set(d, 1e-300)));
  const Vec s = hn::Mul(t, t);
  Vec r = hn::Set(d, 0.0028662257);
  for (const double term : kTerms) r = hn::Add(hn::Mul(r, s), hn::Set(d, term));
  r = hn::Mul(r, t);
  r = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, std::numbers::pi / 2), r), r);
  r = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, std::numbers::pi), r), r);
  return hn::IfThenElse(hn::Lt(y, hn::Zero(d)), hn::Neg(r), r);
}

void sum_angles(std::span<const WindingCap> caps, std::span<const WindingNode> nodes,
                std::span<const std::uint32_t> near, std::span<const std::uint32_t> far,
                const WindingSeries& farther, const glm::dvec3& scale_of, WindingPoints& points) {
  const Lane d;
  const Vec3 scale = splat(scale_of);
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const Vec3 p{hn::Load(d, points.x + i), hn::Load(d, points.y + i), hn::Load(d, points.z + i)};
    const Vec3 from = offset(farther.middle, p, scale),
               cross{hn::Mul(from.y, from.z), hn::Mul(from.z, from.x), hn::Mul(from.x, from.y)};
    const Vec3 squares{hn::Mul(from.x, from.x), hn::Mul(from.y, from.y), hn::Mul(from.z, from.z)};
    Vec sum = hn::Sub(hn::Set(d, farther.angle), dot(splat(farther.gradient), from));
    sum = hn::Add(sum, dot(splat(farther.pure / 2.0), squares));
    sum = hn::Add(sum, dot(splat(farther.mixed), cross));
    for (const std::uint32_t index : far) {
      const WindingNode& node = nodes[index];
      const Vec3 to = offset(node.middle, p, scale);
      const Vec squared = dot(to, to);
      sum = hn::Add(sum, hn::Div(dot(splat(node.dipole), to), hn::Mul(squared, hn::Sqrt(squared))));
    }
    Vec halves = hn::Zero(d);
    for (const std::uint32_t index : near) {
      const WindingCap& cap = caps[index];
      const Vec3 a = offset(cap.corners[0], p, scale), b = offset(cap.corners[1], p, scale),
                 c = offset(cap.corners[2], p, scale);
      const Vec la = hn::Sqrt(dot(a, a)), lb = hn::Sqrt(dot(b, b)), lc = hn::Sqrt(dot(c, c));
      const Vec volume = hn::Mul(hn::Mul(la, lb), lc);
      const Vec real = hn::Add(hn::Add(volume, hn::Mul(dot(a, b), lc)),
                               hn::Add(hn::Mul(dot(b, c), la), hn::Mul(dot(c, a), lb)));
      Vec side = dot(splat(cap.normal), a);
      const Vec bound = hn::Mul(hn::Set(d, cap.doubt), la);
      if (!hn::AllTrue(d, hn::Gt(hn::Abs(side), bound))) {
        alignas(64) double sides[WindingPoints::kStep], bounds[WindingPoints::kStep],
            volumes[WindingPoints::kStep];
        hn::Store(side, d, sides);
        hn::Store(bound, d, bounds);
        hn::Store(volume, d, volumes);
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
          if (std::abs(sides[lane]) > bounds[lane]) continue;
          const glm::dvec3 at(points.x[i + lane], points.y[i + lane], points.z[i + lane]);
          // On the triangle half of the angle is pi, on its border pi / 2, else 0.
          sides[lane] = 1e-9 * volumes[lane] * winding_side(cap, glm::ivec3(at));
        }
        side = hn::Load(d, sides);
      }
      halves = hn::Add(halves, arc(side, real));
    }
    hn::Store(hn::Add(sum, hn::Add(halves, halves)), d, points.angle + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(sum_angles);

void solid_angles(std::span<const WindingCap> caps, std::span<const WindingNode> nodes,
                  std::span<const std::uint32_t> near, std::span<const std::uint32_t> far,
                  const WindingSeries& farther, const glm::dvec3& scale, WindingPoints& points) {
  HWY_DYNAMIC_DISPATCH(sum_angles)(caps, nodes, near, far, farther, scale, points);
}

void WindingSeries::add(const glm::dvec3& dipole, const glm::dvec3& to) {
  const double inverse = 1 / glm::dot(to, to), third = inverse * std::sqrt(inverse);
  const double fifth = third * inverse, along = glm::dot(dipole, to);
  const glm::dvec3 t = 15 * along * inverse * to, d = 3.0 * dipole;
  angle += along * third;
  gradient += 3 * along * fifth * to - third * dipole;
  pure += fifth * (t * to - 2.0 * d * to - 3 * along);
  mixed.x += fifth * (t.y * to.z - d.y * to.z - d.z * to.y);
  mixed.y += fifth * (t.z * to.x - d.z * to.x - d.x * to.z);
  mixed.z += fifth * (t.x * to.y - d.x * to.y - d.y * to.x);
}

void WindingSeries::move(const glm::dvec3& to_middle, const glm::dvec3& scale) {
  const glm::dvec3 d = (to_middle - middle) * scale;
  const glm::dvec3 change(pure.x * d.x + mixed.z * d.y + mixed.y * d.z,
                          mixed.z * d.x + pure.y * d.y + mixed.x * d.z,
                          mixed.y * d.x + mixed.x * d.y + pure.z * d.z);
  angle += glm::dot(gradient + change / 2.0, d);
  gradient += change;
  middle = to_middle;
}

int winding_side(const WindingCap& cap, const glm::ivec3& p) {
  using Wide = glm::vec<3, std::int64_t>;
  const Wide a(cap.lattice[0]), e = Wide(cap.lattice[1]) - a, f = Wide(cap.lattice[2]) - a,
                                d = a - Wide(p);
  const Wide n(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
  const Int128 side = Int128{n.x} * d.x + Int128{n.y} * d.y + Int128{n.z} * d.z;
  if (side != 0) return side > 0 ? 1 : -1;
  const std::int64_t first = n.x != 0 ? n.x : n.y != 0 ? n.y : n.z;
  return first > 0 ? -1 : first < 0 ? 1 : 0;
}

}  // namespace strata
#endif  // HWY_ONCE
