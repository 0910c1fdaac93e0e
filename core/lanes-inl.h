// Vectors whose lanes count. Compiled once for each SIMD target (Highway's dynamic dispatch).

#if defined(STRATA_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STRATA_LANES_INL_H
#undef STRATA_LANES_INL_H
#else
#define STRATA_LANES_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// first, first + 1, first + 2, ... Compilers make Iota(d, first) of a number that they do not know
/// by storing the lanes word by word and loading them as a vector, which waits for all the stores.
template <class D>
HWY_INLINE hn::Vec<D> count_from(D d, hn::TFromD<D> first) {
  return hn::Add(hn::Iota(d, 0), hn::Set(d, first));
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#endif  // include guard
