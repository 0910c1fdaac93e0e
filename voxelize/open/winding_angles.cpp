#include "voxelize/open/winding_angles.h"

#include <algorithm>
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

/// The angles that far nodes and farther ones take up.
HWY_INLINE Vec far_angles(const WindingNear& near, std::span<const std::uint32_t> far,
                          const WindingSeries& farther, const Vec3& p, const Vec3& scale) {
  const Lane d;
  const Vec3 from = offset(farther.middle, p, scale),
             cross{hn::Mul(from.y, from.z), hn::Mul(from.z, from.x), hn::Mul(from.x, from.y)};
  const Vec3 squares{hn::Mul(from.x, from.x), hn::Mul(from.y, from.y), hn::Mul(from.z, from.z)};
  Vec sum = hn::Sub(hn::Set(d, farther.angle), dot(splat(farther.gradient), from));
  sum = hn::Add(sum, dot(splat(farther.pure / 2.0), squares));
  sum = hn::Add(sum, dot(splat(farther.mixed), cross));
  for (const std::uint32_t index : far) {
    const WindingNode& node = near.all.nodes[index];
    const Vec3 to = offset(node.middle, p, scale);
    const Vec squared = dot(to, to);
    sum = hn::Add(sum, hn::Div(dot(splat(node.dipole), to), hn::Mul(squared, hn::Sqrt(squared))));
  }
  return sum;
}

/// The product of complex numbers, and how often the sum of their angles, each of -pi to pi, went
/// around. Products are as exact as roundings, so that the sum's only error is that of one angle.
struct Turning {
  Vec real, imaginary, turns;

  HWY_INLINE Turning()
      : real(hn::Set(Lane(), 1.0)), imaginary(hn::Zero(Lane())), turns(hn::Zero(Lane())) {}

  HWY_INLINE void add(Vec x, Vec y) {
    const Lane d;
    const Vec was = imaginary;
    imaginary = hn::MulAdd(real, y, hn::Mul(was, x));
    real = hn::NegMulAdd(was, y, hn::Mul(real, x));
    // Around where two angles of one sign become one of the other.
    const Vec around = hn::AndNot(hn::Xor(was, y), hn::Xor(was, imaginary));
    // Highway 1.0's IfNegativeThenElse looks at all bits on SSSE3.
    const hn::RebindToSigned<Lane> di;
    const Vec if_around = hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(di, around)));
    turns = hn::Add(turns, hn::And(if_around, hn::CopySign(hn::Set(d, 1.0), y)));
  }
  /// Keeps the product in range. @return false where it was not
  HWY_INLINE bool scale() {
    const Lane d;
    const Vec size = hn::Max(hn::Abs(real), hn::Abs(imaginary));
    const Vec by = hn::Div(hn::Set(d, 1.0), size);
    real = hn::Mul(real, by), imaginary = hn::Mul(imaginary, by);
    return hn::AllTrue(d,
                       hn::And(hn::Gt(size, hn::Set(d, 1e-200)), hn::Lt(size, hn::Set(d, 1e200))));
  }
  HWY_INLINE Vec angle() const {
    const Lane d;
    const Vec principal = hn::CopySign(hn::Abs(arc(imaginary, real)), imaginary);
    return hn::MulAdd(turns, hn::Set(d, 2 * std::numbers::pi), principal);
  }
};

/// On the plane of a triangle the perturbed point decides.
HWY_NOINLINE Vec decided_sides(const WindingCap& cap, Vec side, Vec bound, Vec volume,
                               const WindingPoints& points, std::size_t first) {
  const Lane d;
  alignas(64) double sides[WindingPoints::kStep], bounds[WindingPoints::kStep],
      volumes[WindingPoints::kStep];
  hn::Store(side, d, sides);
  hn::Store(bound, d, bounds);
  hn::Store(volume, d, volumes);
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    if (std::abs(sides[lane]) > bounds[lane]) continue;
    const std::size_t i = first + lane;
    const glm::dvec3 at(points.x[i], points.y[i], points.z[i]);
    // On the triangle half of the angle is pi, on its border pi / 2, else 0.
    sides[lane] = 1e-9 * volumes[lane] * winding_side(cap, glm::ivec3(at));
  }
  return hn::Load(d, sides);
}

HWY_INLINE void see_corners(const WindingNear& near, const Vec3& p, const Vec3& scale) {
  const Lane d;
  for (std::size_t k = 0; k < near.corners.size(); ++k) {
    const Vec3 to = offset(near.corners[k], p, scale);
    WindingCorner& corner = near.seen[k];
    hn::Store(to.x, d, corner.x);
    hn::Store(to.y, d, corner.y);
    hn::Store(to.z, d, corner.z);
    hn::Store(hn::Sqrt(dot(to, to)), d, corner.length);
  }
}

HWY_INLINE Vec3 load(const WindingCorner& corner) {
  const Lane d;
  return {hn::Load(d, corner.x), hn::Load(d, corner.y), hn::Load(d, corner.z)};
}

/// @return false where quick angles left their range
template <WindingSum::Way way>
bool sum_angles(const WindingNear& near, std::span<const std::uint32_t> far,
                const WindingSeries& farther, WindingPoints& points) {
  const Lane d;
  const Vec3 scale = splat(near.all.scale);
  bool in_range = true;
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const Vec3 p{hn::Load(d, points.x + i), hn::Load(d, points.y + i), hn::Load(d, points.z + i)};
    const Vec sum = far_angles(near, far, farther, p, scale);
    see_corners(near, p, scale);
    Vec halves = hn::Zero(d);
    Turning turning;
    for (std::size_t k = 0; k < near.triangles.size(); ++k) {
      const WindingCap& cap = near.all.caps[near.caps[k]];
      const WindingCorner* const corners[3] = {&near.seen[near.triangles[k].x],
                                               &near.seen[near.triangles[k].y],
                                               &near.seen[near.triangles[k].z]};
      const Vec3 a = load(*corners[0]), b = load(*corners[1]), c = load(*corners[2]);
      const Vec la = hn::Load(d, corners[0]->length), lb = hn::Load(d, corners[1]->length),
                lc = hn::Load(d, corners[2]->length);
      const Vec volume = hn::Mul(hn::Mul(la, lb), lc);
      const Vec real = hn::Add(hn::Add(volume, hn::Mul(dot(a, b), lc)),
                               hn::Add(hn::Mul(dot(b, c), la), hn::Mul(dot(c, a), lb)));
      Vec side = dot(splat(cap.normal), a);
      const Vec bound = hn::Mul(hn::Set(d, cap.doubt), la);
      if (!hn::AllTrue(d, hn::Gt(hn::Abs(side), bound))) {
        side = decided_sides(cap, side, bound, volume, points, i);
      }
      if constexpr (way == WindingSum::Way::kExact) {
        halves = hn::Add(halves, arc(side, real));
      } else {
        turning.add(real, side);
        if (k % 4 == 3) in_range &= turning.scale();
      }
    }
    if constexpr (way == WindingSum::Way::kQuick) {
      in_range &= turning.scale();
      halves = turning.angle();
    }
    hn::Store(hn::Add(sum, hn::Add(halves, halves)), d, points.angle + i);
  }
  return in_range;
}

bool sum_exactly(const WindingNear& near, std::span<const std::uint32_t> far,
                 const WindingSeries& farther, WindingPoints& points) {
  return sum_angles<WindingSum::Way::kExact>(near, far, farther, points);
}
bool sum_quickly(const WindingNear& near, std::span<const std::uint32_t> far,
                 const WindingSeries& farther, WindingPoints& points) {
  return sum_angles<WindingSum::Way::kQuick>(near, far, farther, points);
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(sum_exactly);
HWY_EXPORT(sum_quickly);

std::optional<double> WindingSum::write(Way way, const WindingCaps& all,
                                        std::span<const std::uint32_t> near,
                                        std::span<const std::uint32_t> far,
                                        const WindingSeries& farther, WindingPoints& points) {
  if (places_.size() < all.vertices) places_.resize(all.vertices);
  if (++turn_ == 0) {
    std::fill(places_.begin(), places_.end(), Place{});
    turn_ = 1;
  }
  corners_.clear();
  triangles_.clear();
  for (const std::uint32_t index : near) {
    const WindingCap& cap = all.caps[index];
    glm::uvec3& triangle = triangles_.emplace_back();
    for (int i = 0; i < 3; ++i) {
      Place& place = places_[cap.vertices[i]];
      if (place.turn != turn_) {
        place = {turn_, static_cast<std::uint32_t>(corners_.size())};
        corners_.push_back(cap.corners[i]);
      }
      triangle[i] = place.corner;
    }
  }
  if (seen_.size() < corners_.size()) seen_.resize(2 * corners_.size());
  const WindingNear caps{all, near, triangles_, corners_, seen_.data()};
  if (way == Way::kExact) {
    HWY_DYNAMIC_DISPATCH(sum_exactly)(caps, far, farther, points);
    return 0.0;
  }
  // An exact angle is twice a sum of arc tangents, each off by up to 2e-8.
  if (!HWY_DYNAMIC_DISPATCH(sum_quickly)(caps, far, farther, points)) return std::nullopt;
  return 6e-8 * static_cast<double>(near.size() + 1);
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
