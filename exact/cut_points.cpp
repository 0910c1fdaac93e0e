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

// The whole number nearest to quotient + remainder / w, ties up, for a quotient that is nearly
// right.
template <class Integer>
std::int64_t corrected(Integer remainder, const Integer& w, std::int64_t quotient) {
  while (remainder < Integer(0)) {
    remainder = remainder + w;
    --quotient;
  }
  while (remainder >= w) {
    remainder = remainder - w;
    ++quotient;
  }
  return quotient + (remainder >= w - remainder ? 1 : 0);
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
  // The quotient in doubles is off by less than 4, since it is below 2^53 and was rounded four
  // times; its remainder tells by how much.
  const double w = to_double(point.w);
  const auto coordinate = [&](const Int256& numerator) {
    auto quotient = static_cast<std::int64_t>(to_double(numerator) / w * (1 << kFileBits));
    return corrected((Int256(numerator) << kFileBits) - product<Int256>(quotient, point.w),
                     Int256(point.w), quotient);
  };
  return {coordinate(point.x), coordinate(point.y), coordinate(point.z)};
}

FilePoint round_for_file(const EdgePoint& point, bool& moved) {
  // p + (q - p) s_p / w. The product of the difference and s_p has 118 bits, 142 with 24 more; the
  // remainder has 94, so what is lost above 128 bits is not needed.
  const Int128 s = point.weight() < 0 ? -point.s_p : point.s_p;
  const Int128 w = point.weight() < 0 ? -point.weight() : point.weight();
  const double ratio = static_cast<double>(s) / static_cast<double>(w) * (1 << kFileBits);
  moved = false;
  const auto coordinate = [&](std::int32_t p, std::int32_t q) {
    const std::int32_t along = q - p;
    if (along == 0) return std::int64_t{p} << kFileBits;
    const auto quotient = static_cast<std::int64_t>(ratio * along);
    const UInt128 whole = static_cast<UInt128>(s) * static_cast<UInt128>(Int128{along})
                          << kFileBits;
    const auto left = static_cast<Int128>(whole - static_cast<UInt128>(Int128{quotient}) *
                                                      static_cast<UInt128>(w));
    const std::int64_t rounded = corrected(left, w, quotient);
    moved = moved || left != (Int128{rounded} - quotient) * w;
    return (std::int64_t{p} << kFileBits) + rounded;
  };
  return {coordinate(point.p.x, point.q.x), coordinate(point.p.y, point.q.y),
          coordinate(point.p.z, point.q.z)};
}

bool is_file_point(const RationalPoint& point, const FilePoint& rounded) {
  return (point.x << kFileBits) == product<Int256>(point.w, rounded.x) &&
         (point.y << kFileBits) == product<Int256>(point.w, rounded.y) &&
         (point.z << kFileBits) == product<Int256>(point.w, rounded.z);
}

FinePoint round_fine(const RationalPoint& point) {
  const auto coordinate = [&](const Int256& numerator) {
    return narrow<Int128>(rounded<5>(numerator, point.w, kFineBits));
  };
  return {coordinate(point.x), coordinate(point.y), coordinate(point.z)};
}

}  // namespace strata::exact
