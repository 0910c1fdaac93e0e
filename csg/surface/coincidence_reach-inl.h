// Coincidence::range() for a vector of pixels. Compiled once for each SIMD target.

#if defined(STRATA_COINCIDENCE_REACH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STRATA_COINCIDENCE_REACH_INL_H
#undef STRATA_COINCIDENCE_REACH_INL_H
#else
#define STRATA_COINCIDENCE_REACH_INL_H
#endif

#include <hwy/highway.h>

#include "csg/surface/visible_surface.h"

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {

/// Depth steps within which a crossing may coincide with one at `depth`, if neither is steep.
template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE V coincidence_reach(D d, const Coincidence::Range& range, V depth) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const hn::RebindToFloat<D> df;
  const auto at = hn::ConvertTo(df, hn::BitCast(di, depth));
  const auto nearness =
      hn::Sub(hn::Set(df, range.intercept), hn::Mul(hn::Set(df, range.slope), at));
  const auto square = hn::Mul(nearness, hn::Mul(nearness, hn::Set(df, range.quadratic)));
  const auto reach = hn::Add(hn::Set(df, range.constant), square);
  const auto most = hn::Set(df, static_cast<float>(kPictureDepthLimit));
  return hn::BitCast(d, hn::ConvertTo(di, hn::Min(reach, most)));
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#endif  // include guard
