#include "exact/cut_points.h"

namespace strata::exact {
namespace {

// c * w + numerator for the coordinate c of the origin that the numerator is about.
Int256 about_zero(std::int32_t origin, const Int192& w, const Int256& numerator) {
  return product<Int256>(origin, w) + numerator;
}

// Rounded to multiples of 2^-bits; the caller says why the shifted numerator fits into kWords.
template <int kWords>
Wide<kWords> rounded(const Int256& numerator, const Int192& w, int bits) {
  return divide_round(Wide<kWords>(numerator) << bits, w);
}

}  // namespace

RationalPoint rational(const LatticePoint& p) { return {p.x, p.y, p.z, 1}; }

RationalPoint rational(const EdgePoint& point) {
  const bool turn = point.weight() < 0;
  const Int128 s_p = turn ? -point.s_p : point.s_p;
  const Int192 w = turn ? -point.weight() : point.weight();
  const LatticePoint along = point.q - point.p;
  // (q - p) s_p: at most 2 S^4, 4b + 2 bits; 118 for b = 29.
  return {about_zero(point.p.x, w, s_p * along.x), about_zero(point.p.y, w, s_p * along.y),
          about_zero(point.p.z, w, s_p * along.z), w};
}

RationalPoint rational(const Plane& a, const Plane& b, const Plane& c) {
  const Cross ab = cross(a.normal, b.normal), ca = cross(c.normal, a.normal);
  Int192 w = dot(c.normal, ab);
  assert(sign_of(w) != 0);
  // About the base of a, whose offset is then 0: (d_b (c x a) + d_c (a x b)) / det3(a, b, c).
  Int128 d_b = b.offset(a.base), d_c = c.offset(a.base);
  if (w.negative()) {
    w = -w;
    d_b = -d_b;
    d_c = -d_c;
  }
  const auto numerator = [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    return about_zero(a.base[k], w, product<Int256>(d_b, ca[i]) + product<Int256>(d_c, ab[i]));
  };
  return {numerator(0), numerator(1), numerator(2), w};
}

int side_of_plane(const RationalPoint& point, const Plane& plane) {
  const Normal& n = plane.normal;
  return sign_of(product<Int320>(n.x, point.x) + product<Int320>(n.y, point.y) +
                 product<Int320>(n.z, point.z) - product<Int320>(plane.offset(), point.w));
}

FilePoint round_for_file(const RationalPoint& point) {
  const auto coordinate = [&](const Int256& numerator) {
    return narrow<std::int64_t>(rounded<4>(numerator, point.w, kFileBits));
  };
  return {coordinate(point.x), coordinate(point.y), coordinate(point.z)};
}

bool is_file_point(const RationalPoint& point, const FilePoint& rounded) {
  return point.x << kFileBits == product<Int256>(point.w, rounded.x) &&
         point.y << kFileBits == product<Int256>(point.w, rounded.y) &&
         point.z << kFileBits == product<Int256>(point.w, rounded.z);
}

FinePoint round_fine(const RationalPoint& point) {
  const auto coordinate = [&](const Int256& numerator) {
    return narrow<Int128>(rounded<5>(numerator, point.w, kFineBits));
  };
  return {coordinate(point.x), coordinate(point.y), coordinate(point.z)};
}

}  // namespace strata::exact
