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

void sum_exactly(const WindingCaps& all, const WindingView& view, WindingPoints& points) {
  const Lane d;
  const Vec3 scale = splat(all.scale);
  const WindingSeries& farther = view.farther;
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const Vec3 p{hn::Load(d, points.x + i), hn::Load(d, points.y + i), hn::Load(d, points.z + i)};
    const Vec3 from = offset(farther.middle, p, scale),
               cross{hn::Mul(from.y, from.z), hn::Mul(from.z, from.x), hn::Mul(from.x, from.y)};
    const Vec3 squares{hn::Mul(from.x, from.x), hn::Mul(from.y, from.y), hn::Mul(from.z, from.z)};
    Vec sum = hn::Sub(hn::Set(d, farther.angle), dot(splat(farther.gradient), from));
    sum = hn::Add(sum, dot(splat(farther.pure / 2.0), squares));
    sum = hn::Add(sum, dot(splat(farther.mixed), cross));
    for (const std::uint32_t index : view.far) {
      const WindingNode& node = all.nodes[index];
      const Vec3 to = offset(node.middle, p, scale);
      const Vec squared = dot(to, to);
      sum = hn::Add(sum, hn::Div(dot(splat(node.dipole), to), hn::Mul(squared, hn::Sqrt(squared))));
    }
    Vec halves = hn::Zero(d);
    for (const std::uint32_t index : view.near) {
      const WindingCap& cap = all.caps[index];
      const Vec3 a = offset(cap.corners[0], p, scale), b = offset(cap.corners[1], p, scale),
                 c = offset(cap.corners[2], p, scale);
      const Vec la = hn::Sqrt(dot(a, a)), lb = hn::Sqrt(dot(b, b)), lc = hn::Sqrt(dot(c, c));
      const Vec volume = hn::Mul(hn::Mul(la, lb), lc);
      const Vec real = hn::Add(hn::Add(volume, hn::Mul(dot(a, b), lc)),
                               hn::Add(hn::Mul(dot(b, c), la), hn::Mul(dot(c, a), lb)));
      Vec side = dot(splat(cap.normal), a);
      const Vec bound = hn::Mul(hn::Set(d, cap.doubt), la);
      if (!hn::AllTrue(d, hn::Gt(hn::Abs(side), bound))) {
        side = decided_sides(cap, side, bound, volume, points, i);
      }
      halves = hn::Add(halves, arc(side, real));
    }
    hn::Store(hn::Add(sum, hn::Add(halves, halves)), d, points.angle + i);
  }
}

using Short = hn::CappedTag<float, WindingPoints::kStep>;
using ShortVec = hn::Vec<Short>;

HWY_INLINE ShortVec dot(ShortVec ax, ShortVec ay, ShortVec az, ShortVec bx, ShortVec by,
                        ShortVec bz) {
  return hn::MulAdd(az, bz, hn::MulAdd(ay, by, hn::Mul(ax, bx)));
}

/// The product of complex numbers, and how often the sum of their angles, each of -pi to pi, went
/// around. A product's angle is off by no more than a rounding.
struct Turning {
  ShortVec real, imaginary, turns;

  HWY_INLINE Turning()
      : real(hn::Set(Short(), 1.0F)), imaginary(hn::Zero(Short())), turns(hn::Zero(Short())) {}

  HWY_INLINE void add(ShortVec x, ShortVec y) {
    const Short d;
    const hn::RebindToSigned<Short> di;
    const ShortVec was = imaginary;
    imaginary = hn::MulAdd(real, y, hn::Mul(was, x));
    real = hn::NegMulAdd(was, y, hn::Mul(real, x));
    // Around where two angles of one sign become one of the other. (Highway 1.0's
    // IfNegativeThenElse looks at all bits on SSSE3.)
    const ShortVec around = hn::AndNot(hn::Xor(was, y), hn::Xor(was, imaginary));
    const ShortVec if_around = hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(di, around)));
    turns = hn::Add(turns, hn::And(if_around, hn::CopySign(hn::Set(d, 1.0F), y)));
  }
  HWY_INLINE void scale() {
    const Short d;
    const ShortVec by = hn::Div(hn::Set(d, 1.0F), hn::Max(hn::Abs(real), hn::Abs(imaginary)));
    real = hn::Mul(real, by), imaginary = hn::Mul(imaginary, by);
  }
  HWY_INLINE ShortVec angle() const {
    const Short d;
    constexpr float kTerms[] = {-0.0161657367F, 0.0429096138F, -0.0752896400F, 0.1065626393F,
                                -0.1420889944F, 0.1999355085F, -0.3333314528F, 1.0F};
    const ShortVec x = hn::Abs(real), y = hn::Abs(imaginary);
    const ShortVec t = hn::Div(hn::Min(x, y), hn::Max(x, y)), s = hn::Mul(t, t);
    ShortVec r = hn::Set(d, 0.0028662257F);
    for (const float term : kTerms) r = hn::MulAdd(r, s, hn::Set(d, term));
    r = hn::Mul(r, t);
    constexpr float kPi = std::numbers::pi_v<float>;
    r = hn::IfThenElse(hn::Gt(y, x), hn::Sub(hn::Set(d, kPi / 2), r), r);
    r = hn::IfThenElse(hn::Lt(real, hn::Zero(d)), hn::Sub(hn::Set(d, kPi), r), r);
    return hn::MulAdd(turns, hn::Set(d, 2 * kPi), hn::CopySign(r, imaginary));
  }
};

/// The angles that far nodes and farther ones take up.
HWY_INLINE ShortVec far_angles(const WindingFloats& from, ShortVec x, ShortVec y, ShortVec z) {
  const Short d;
  const auto term = [&](int i) { return hn::Set(d, from.series[i]); };
  ShortVec sum = hn::Add(term(0), dot(term(1), term(2), term(3), x, y, z));
  sum = hn::Add(sum, dot(term(4), term(5), term(6), hn::Mul(x, x), hn::Mul(y, y), hn::Mul(z, z)));
  sum = hn::Add(sum, dot(term(7), term(8), term(9), hn::Mul(y, z), hn::Mul(z, x), hn::Mul(x, y)));
  for (const WindingFloats::Far& far : from.far) {
    const ShortVec tx = hn::Sub(hn::Set(d, far.x), x), ty = hn::Sub(hn::Set(d, far.y), y),
                   tz = hn::Sub(hn::Set(d, far.z), z);
    const ShortVec square = dot(tx, ty, tz, tx, ty, tz);
    const ShortVec along = dot(hn::Set(d, far.dipole_x), hn::Set(d, far.dipole_y),
                               hn::Set(d, far.dipole_z), tx, ty, tz);
    sum = hn::Add(sum, hn::Div(along, hn::Mul(square, hn::Sqrt(square))));
  }
  return sum;
}

/// Writes how the corners are seen. @return the length to the nearest
HWY_INLINE ShortVec see_corners(WindingFloats& from, ShortVec x, ShortVec y, ShortVec z) {
  const Short d;
  ShortVec nearest = hn::Set(d, 1e30F);
  for (std::size_t k = 0; k < from.corners.size(); ++k) {
    const WindingFloats::Corner& corner = from.corners[k];
    WindingFloats::Seen& seen = from.seen[k];
    const ShortVec tx = hn::Sub(hn::Set(d, corner.x), x), ty = hn::Sub(hn::Set(d, corner.y), y),
                   tz = hn::Sub(hn::Set(d, corner.z), z);
    const ShortVec length = hn::Sqrt(dot(tx, ty, tz, tx, ty, tz));
    hn::Store(tx, d, seen.x);
    hn::Store(ty, d, seen.y);
    hn::Store(tz, d, seen.z);
    hn::Store(length, d, seen.length);
    nearest = hn::Min(nearest, length);
  }
  return nearest;
}

void sum_quickly(WindingFloats& from, WindingPoints& points) {
  const Short d;
  const auto load = [&](const float* at) { return hn::Load(d, at); };
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const ShortVec x = load(from.x + i), y = load(from.y + i), z = load(from.z + i);
    const ShortVec sum = far_angles(from, x, y, z), nearest = see_corners(from, x, y, z);
    // The distance of numbers from the half of the axis where angles change their sign, at least;
    // the sum of the inverses of their distances from 0, at most.
    ShortVec from_axis = hn::Set(d, 4.0F), inverses = hn::Zero(d);
    Turning turning;
    for (std::size_t k = 0; k < from.triangles.size(); ++k) {
      const glm::uvec3& triangle = from.triangles[k];
      const WindingFloats::Seen &a = from.seen[triangle.x], &b = from.seen[triangle.y],
                                &c = from.seen[triangle.z];
      const ShortVec ax = load(a.x), ay = load(a.y), az = load(a.z), la = load(a.length);
      const ShortVec bx = load(b.x), by = load(b.y), bz = load(b.z), lb = load(b.length);
      const ShortVec cx = load(c.x), cy = load(c.y), cz = load(c.z), lc = load(c.length);
      const ShortVec volume = hn::Mul(hn::Mul(la, lb), lc);
      ShortVec real = hn::MulAdd(dot(ax, ay, az, bx, by, bz), lc, volume);
      real = hn::MulAdd(dot(bx, by, bz, cx, cy, cz), la, real);
      real = hn::MulAdd(dot(cx, cy, cz, ax, ay, az), lb, real);
      const ShortVec side =
          dot(ax, ay, az, hn::NegMulAdd(bz, cy, hn::Mul(by, cz)),
              hn::NegMulAdd(bx, cz, hn::Mul(bz, cx)), hn::NegMulAdd(by, cx, hn::Mul(bx, cy)));
      const ShortVec inverse = hn::ApproximateReciprocal(volume);
      const ShortVec u = hn::Mul(real, inverse), v = hn::Mul(side, inverse);
      const ShortVec height = hn::Abs(v);
      inverses = hn::Add(inverses, hn::ApproximateReciprocal(hn::Max(hn::Abs(u), height)));
      from_axis = hn::Min(from_axis, hn::Max(u, height));
      turning.add(u, v);
      if (k % 4 == 3) turning.scale();
    }
    turning.scale();
    const ShortVec halves = turning.angle();
    // Of each number. Not known at corners.
    const ShortVec number_off =
        hn::Add(hn::Set(d, from.number_off), hn::Div(hn::Set(d, from.nearest_off), nearest));
    const ShortVec off =
        hn::MulAdd(hn::Add(number_off, number_off), inverses, hn::Set(d, from.base_off));
    const auto known = hn::And(hn::Gt(from_axis, number_off), hn::Gt(nearest, hn::Zero(d)));
    alignas(32) float angles[WindingPoints::kStep], offs[WindingPoints::kStep];
    hn::Store(hn::Add(sum, hn::Add(halves, halves)), d, angles);
    hn::Store(hn::IfThenElse(known, off, hn::Set(d, 1e30F)), d, offs);
    std::copy_n(angles, hn::Lanes(d), points.angle + i);
    std::copy_n(offs, hn::Lanes(d), points.off + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(sum_exactly);
HWY_EXPORT(sum_quickly);

/// The near caps, and their corners, each of which is there once.
void WindingSum::set_corners(const WindingCaps& caps, const WindingView& view) {
  if (places_.size() < caps.vertices) places_.resize(caps.vertices);
  if (++turn_ == 0) {
    std::fill(places_.begin(), places_.end(), Place{});
    turn_ = 1;
  }
  floats_.corners.clear();
  floats_.triangles.clear();
  for (const std::uint32_t index : view.near) {
    const WindingCap& cap = caps.caps[index];
    glm::uvec3& triangle = floats_.triangles.emplace_back();
    for (int i = 0; i < 3; ++i) {
      Place& place = places_[cap.vertices[i]];
      if (place.turn != turn_) {
        place = {turn_, static_cast<std::uint32_t>(floats_.corners.size())};
        const glm::vec3 to((cap.corners[i] - view.middle) * caps.scale);
        floats_.corners.push_back({to.x, to.y, to.z});
      }
      triangle[i] = place.corner;
    }
  }
  if (floats_.seen.size() < floats_.corners.size()) floats_.seen.resize(2 * floats_.corners.size());
}

/// The nodes and the points, and what the angles may be off by. In units of 2^-24: the lengths and
/// products of a cap's corners make its complex number off by 75 of the volume at most. Angles of
/// numbers are off by no more than that over the distance from 0; from the negative axis, so that
/// the side is sure. Offsets are exact where voxels are cubes, else off by the ball's radius.
void WindingSum::set_rest(const WindingCaps& caps, const WindingView& view,
                          const WindingPoints& points) {
  floats_.far.clear();
  for (const std::uint32_t index : view.far) {
    const WindingNode& node = caps.nodes[index];
    const glm::vec3 to((node.middle - view.middle) * caps.scale), dipole(node.dipole);
    floats_.far.push_back({to.x, to.y, to.z, dipole.x, dipole.y, dipole.z});
  }
  const WindingSeries& farther = view.farther;
  // The offsets of the series go from the points to the middle.
  const double terms[10] = {farther.angle,        farther.gradient.x,   farther.gradient.y,
                            farther.gradient.z,   farther.pure.x / 2.0, farther.pure.y / 2.0,
                            farther.pure.z / 2.0, farther.mixed.x,      farther.mixed.y,
                            farther.mixed.z};
  double size = 0;
  for (int i = 0; i < 10; ++i) {
    floats_.series[i] = static_cast<float>(terms[i]);
    const int power = i == 0 ? 0 : i < 4 ? 1 : 2;
    size += std::abs(terms[i]) * (power == 0   ? 1
                                  : power == 1 ? view.radius
                                               : view.radius * view.radius);
  }
  for (std::size_t i = 0; i < points.count; ++i) {
    floats_.x[i] = static_cast<float>((points.x[i] - view.middle.x) * caps.scale.x);
    floats_.y[i] = static_cast<float>((points.y[i] - view.middle.y) * caps.scale.y);
    floats_.z[i] = static_cast<float>((points.z[i] - view.middle.z) * caps.scale.z);
  }
  constexpr double kUnit = 1.0 / (1 << 24);
  const auto near = static_cast<double>(view.near.size()),
             far = static_cast<double>(view.far.size());
  const bool cubes = caps.scale == glm::dvec3(1.0);
  floats_.base_off =
      static_cast<float>(1e-5 + 1e-6 * near + (2e-6 + 1e-7 * far) * view.far_bound + 2e-6 * size);
  floats_.number_off = static_cast<float>(100 * kUnit);
  floats_.nearest_off = cubes ? 0.0F : static_cast<float>(100 * kUnit * view.radius);
}

void WindingSum::write(Way way, const WindingCaps& caps, const WindingView& view,
                       WindingPoints& points) {
  if (way == Way::kExact) {
    std::fill_n(points.off, points.count, 0.0);
    HWY_DYNAMIC_DISPATCH(sum_exactly)(caps, view, points);
    return;
  }
  set_corners(caps, view);
  set_rest(caps, view, points);
  HWY_DYNAMIC_DISPATCH(sum_quickly)(floats_, points);
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
