#include "exact/flat_predicates.h"

namespace strata::exact {
namespace {

// Eight roundings: of a leaf and three in a minor, of a leaf and two products, of two sums.
int filtered_orient2d(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, int u,
                      int v) {
  const auto real = [&](const RationalPoint& p) {
    return filters::RealNormal(to_double(numerator(p, u)), to_double(numerator(p, v)),
                               to_double(p.w));
  };
  return filters::dot(real(c), filters::cross(real(a), real(b))).sign();
}

}  // namespace

Int640 orient2d_value(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, int u,
                      int v) {
  // A minor of numerators is at most 2 (12 S^7)^2, 14b + 9 bits; 415 for b = 29.
  const auto minor = [](const auto& p, const auto& q, const auto& r, const auto& s) {
    return product<Wide<7>>(p, s) - product<Wide<7>>(q, r);
  };
  const Int256 &au = numerator(a, u), &av = numerator(a, v), &bu = numerator(b, u),
               &bv = numerator(b, v);
  return product<Int640>(numerator(c, u), minor(av, a.w, bv, b.w)) +
         product<Int640>(numerator(c, v), minor(a.w, au, b.w, bu)) +
         product<Int640>(c.w, minor(au, av, bu, bv));
}

int orient2d(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, int u, int v) {
  if constexpr (kFilters) {
    if (const int sign = filtered_orient2d(a, b, c, u, v); sign != 0) return sign;
  }
  return sign_of(orient2d_value(a, b, c, u, v));
}

}  // namespace strata::exact
